// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <memory>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// The closures of all legs that were read at one pose, whitened by their common covariance: with
// the closures h (those of a leg on its own parameter block) and whitening W, residual = W h.
class JointCost final : public ceres::CostFunction {
 public:
  JointCost(std::vector<std::unique_ptr<ceres::CostFunction>> closures, Eigen::MatrixXd whitening);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::vector<std::unique_ptr<ceres::CostFunction>> closures_;
  Eigen::MatrixXd whitening_;  // closures x closures
};

}  // namespace symkin
