// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// The closures h of the legs that were read at one measured pose, and the Cholesky factor L of
// their covariance: L^-1 h is standard normal at the true parameters.
struct WhitenedPose {
  Index row;                // of the measurements
  std::vector<Index> legs;  // that were read, ascending
  Index closures;           // of each leg
  Index first;              // row of its first closure in the system
  RowMatrix factor;         // L

  Index count() const { return static_cast<Index>(legs.size()) * closures; }
};

// Closures of some legs, linearised and whitened pose by pose: one least-squares problem in those
// legs' parameters. Of one leg alone it is the problem of the estimator `implicit`, of all legs
// that of `joint`.
struct WhitenedClosures {
  std::vector<Index> legs;
  std::vector<WhitenedPose> poses;
  Vector residual;                // m, L^-1 h
  RowMatrix jacobian;             // m x their estimated parameters, L^-1 dh/dparam
  std::vector<ClosureRows> rows;  // of each of the legs at all measured poses

  // Where a leg's parameters begin in the columns of the jacobian, and where they all end.
  std::vector<Index> columns;

  // Place of a leg among these.
  Index position(Index leg) const;
};

// Throws InvalidInput, naming the pose, where the covariance of its closures is singular.
WhitenedClosures whiten_closures(const Mechanism& mechanism, const MeasurementSet& measurements,
                                 const std::vector<Index>& legs, PoseUse use,
                                 const MeasurementNoise& noise);

// Poses and readings which the closures make most likely at the parameters, and how far they are
// from those measured. To first order they do not depend on the residuals; where the measured ones
// do, what little the noise changes in the derivatives adds up with them instead of averaging out.
struct LikelyMeasurements {
  MeasurementSet at;
  RowMatrix pose_steps;     // N x dof, from the measured to these; 0 where no leg was read
  RowMatrix reading_steps;  // N x legs
};
LikelyMeasurements most_likely(const WhitenedClosures& system, PoseSpace space,
                               const MeasurementSet& measured, const MeasurementNoise& noise);

// Residuals of a system that was linearised there, as those of what was measured.
void count_from_measured(const LikelyMeasurements& likely, WhitenedClosures& system);

// 0, 1, ..., count - 1
std::vector<Index> all_legs(Index count);

}  // namespace symkin
