// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// N poses that were measured in full as the kernels take them: addresses and counts alone, as those
// of LegKernels. A row a pose; where a leg was not read, its rows are zero.
struct FullPoseRows {
  struct OfLeg {
    const double *closure, *by_unknowns, *by_pose, *by_reading;
  };
  Index count, legs, dof, width;  // width: scalars of a leg
  const OfLeg* of_legs;
  const double* errors;             // legs, of the readings
  const double* reading_variances;  // legs, 0 where not read
  const double* unread;             // legs, 1 where not read, else 0
  const double* pose_variances;     // dof
  const double* misfits;            // dof, of the measured pose
  const double* turns;              // 3 x 3, P^-1 of the orientation by columns; if dof is 6
  // What the elimination gives:
  double* precisions;   // lower triangle of the inverse of the conditions' covariance, row by row
  double* multipliers;  // legs, that inverse times the conditions
  double* chi_squares;
  double* pivots;  // what the other legs leave of a condition's variance, at the least
};

struct FullPoseKernels {
  void (*eliminate)(const FullPoseRows& rows);
  // Adds what `count` of the poses say at their weights, in the legs' own scalars: to the gradient
  // (legs x width), and to the blocks of the information on and below the diagonal.
  void (*add)(const FullPoseRows& rows, const Index* poses, Index count, const double* weights,
              double* information, double* gradient);
  // The tangents of the poses (dof), and the new errors of their readings (legs), where the
  // unknowns' step changes the closures by `effects` (legs).
  void (*move)(const FullPoseRows& rows, const double* effects, double* moves, double* errors);

  static constexpr Index kMostLegs = 32;
};

// Those for this processor; results are the same on all.
const FullPoseKernels& full_pose_kernels();

}  // namespace symkin
