// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// How a per-leg least-squares estimate answers to errors of its closures: to first order
// estimate - truth = -influence * h. `rows` are the leg's measured poses, ascending, one a closure
// (n); the errors of closures of one pose are independent.
struct LegInfluence {
  std::vector<Index> rows;
  RowMatrix influence;  // p x n
  RowMatrix by_pose;    // n x dof, dh/dpose
  Vector variances;     // n, of h by the declared noise
  Vector deleted;       // n, closures as the leg's other poses predict them: (1 - leverage)^-1 h
};

// Covariance of all legs' parameters, (legs p) x (legs p), from the declared noise: errors of a
// pose are shared by the legs that use it, errors of a reading belong to one leg.
RowMatrix declared_covariance(const std::vector<LegInfluence>& legs, PoseSpace space,
                              const MeasurementNoise& noise);

// The same from the residuals themselves, whatever the noise is and however it is split: the
// jackknife's covariance, HC3 of MacKinnon and White (1985), the closures of a pose together.
RowMatrix residual_covariance(const std::vector<LegInfluence>& legs);

}  // namespace symkin
