// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// (A'A)^-1 of N x p rows, computed with columns of length one; infinite if the columns are
// dependent.
RowMatrix inverse_information(const RowMatrix& rows);

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

// The influence of least squares with residuals h * factor (n x 1 each), a loss's weight being a
// factor of its root.
RowMatrix least_squares_influence(const RowMatrix& by_parameters, const Vector& factors);

// Covariance of all legs' parameters, (legs p) x (legs p), from the declared noise: errors of a
// pose are shared by the legs that use it, errors of a reading belong to one leg.
RowMatrix declared_covariance(const std::vector<LegInfluence>& legs, PoseSpace space,
                              const MeasurementNoise& noise);

// The same from the residuals themselves, whatever the noise is and however it is split: the
// jackknife's covariance, HC3 of MacKinnon and White (1985), the closures of a pose together.
RowMatrix residual_covariance(const std::vector<LegInfluence>& legs);

}  // namespace symkin
