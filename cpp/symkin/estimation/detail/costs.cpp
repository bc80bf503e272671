// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/costs.hpp"

#include <utility>

namespace symkin {

ScaledCost::ScaledCost(std::unique_ptr<ceres::CostFunction> cost, double factor)
    : cost_(std::move(cost)), factor_(factor) {
  set_num_residuals(cost_->num_residuals());
  *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
}

bool ScaledCost::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  if (!cost_->Evaluate(parameters, residuals, jacobians)) {
    return false;
  }
  Eigen::Map<Vector>(residuals, num_residuals()) *= factor_;
  for (std::size_t i = 0; jacobians != nullptr && i < parameter_block_sizes().size(); ++i) {
    if (jacobians[i] != nullptr) {
      Eigen::Map<Vector>(jacobians[i], num_residuals() * parameter_block_sizes()[i]) *= factor_;
    }
  }
  return true;
}

JointCost::JointCost(std::vector<std::unique_ptr<ceres::CostFunction>> closures,
                     Eigen::MatrixXd whitening)
    : closures_(std::move(closures)), whitening_(std::move(whitening)) {
  set_num_residuals(static_cast<int>(closures_.size()));
  for (const auto& closure : closures_) {
    mutable_parameter_block_sizes()->push_back(closure->parameter_block_sizes().front());
  }
}

bool JointCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  const auto legs = static_cast<Index>(closures_.size());
  Vector h(legs);
  for (Index leg = 0; leg < legs; ++leg) {
    const auto i = static_cast<std::size_t>(leg);
    const bool wanted = jacobians != nullptr && jacobians[i] != nullptr;
    const Index size = parameter_block_sizes()[i];
    Eigen::RowVectorXd gradient(size);
    double* gradient_data = gradient.data();
    if (!closures_[i]->Evaluate(&parameters[i], &h[leg], wanted ? &gradient_data : nullptr)) {
      return false;
    }
    if (wanted) {
      Eigen::Map<RowMatrix>(jacobians[i], legs, size) = whitening_.col(leg) * gradient;
    }
  }
  Eigen::Map<Vector>(residuals, legs) = whitening_ * h;
  return true;
}

}  // namespace symkin
