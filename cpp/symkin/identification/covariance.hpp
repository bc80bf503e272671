// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/mechanism.hpp"
#include "symkin/noise.hpp"

namespace symkin {

// (A'A)^-1 of N x p rows, computed with columns of length one; infinite if the columns are
// dependent.
RowMatrix inverse_information(const Eigen::MatrixXd& rows);

// How a per-leg least-squares estimate answers to errors of its closures: to first order
// estimate - truth = -influence * h. `rows` are the leg's measured poses.
struct LegInfluence {
  std::vector<Index> rows;
  RowMatrix influence;  // p x n
  RowMatrix by_pose;    // n x dof, dh/dpose
  Vector by_reading;    // n, dh/dpsi
  double spread = 1;    // factor on the declared standard deviations
};

// The influence of weighted least squares with residuals h * factor (n x 1 each).
RowMatrix least_squares_influence(const RowMatrix& by_parameters, const Vector& factors,
                                  const Vector& loss_weights);

// Covariance of all legs' parameters, (legs p) x (legs p): errors of a pose are shared by the legs
// that use it, errors of a reading belong to one leg.
RowMatrix combined_covariance(const std::vector<LegInfluence>& legs, PoseSpace space,
                              const MeasurementNoise& noise);

}  // namespace symkin
