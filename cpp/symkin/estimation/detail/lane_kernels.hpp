// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// Linearised closures of legs side by side, as LegModel::linearise_lanes() writes them, as the
// kernels take them: addresses and counts alone, as those of LegKernels. Of every number those of
// all lanes stand one behind the other.
struct ClosureLanes {
  Index count, closures;  // poses, and rows of each
  Index parameters, dof;  // in a row
  const Index* estimated;
  Index size;          // so many of the parameters
  double* rows;        // count x closures x (parameters + dof + 2)
  double* precisions;  // count x closures, one over the variances
  double* squares;     // count, of the whitened closures of a pose
  double* room;        // 8 (size + closures + 1)^2
};

// Sums over the rows of a lane.
struct LaneSums {
  double* closures;  // of the squares of closures as they are
  double* judged;    // of those without correlation, by the precisions before
  double* whitened;  // of `squares`
};

struct LaneKernels {
  Index lanes;
  // Takes from each closure of a pose what those before it say of it, and finds its precision from
  // the variances of the pose's tangent (dof numbers, of no lane) and of the reading; 0 where
  // `present` (count) is 0.
  void (*whiten)(const ClosureLanes& rows, const double* pose_variances, double reading_variance,
                 const double* present, const LaneSums& sums);
  // The lower triangle of J'W J, size x size, and J'W h. W are the precisions times the poses'
  // weights, if there are any; `curvatures` (or null) of poses add their c times (J'P h)(J'P h)'.
  void (*sum)(const ClosureLanes& rows, const double* weights, const double* curvatures,
              double* information, double* gradient);
  // As NormalSteps::solve() without damping, of columns of length one.
  void (*solve)(const ClosureLanes& rows, const double* information, const double* gradient,
                double* step, double* decrease, double* least_pivot);
  void (*invert)(const ClosureLanes& rows, const double* information, double* inverse);
  // From the inverse of the information: the mean leverages of the poses' rows, and the diagonal of
  // the jackknife's covariance, see residual_covariance().
  void (*influence)(const ClosureLanes& rows, const double* inverse, double* leverages,
                    double* variances);
};

// Those for this processor; what a lane gets depends on nothing but that lane.
const LaneKernels& lane_kernels();

}  // namespace symkin
