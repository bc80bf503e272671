// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/costs.hpp"

#include <utility>

namespace symkin {

JointCost::JointCost(std::vector<std::unique_ptr<ceres::CostFunction>> closures,
                     Eigen::MatrixXd whitening)
    : closures_(std::move(closures)), whitening_(std::move(whitening)) {
  set_num_residuals(static_cast<int>(whitening_.rows()));
  for (const auto& closure : closures_) {
    mutable_parameter_block_sizes()->push_back(closure->parameter_block_sizes().front());
  }
}

bool JointCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  Vector h(num_residuals());
  Index first = 0;
  for (std::size_t i = 0; i < closures_.size(); ++i) {
    const bool wanted = jacobians != nullptr && jacobians[i] != nullptr;
    const Index count = closures_[i]->num_residuals();
    const Index size = parameter_block_sizes()[i];
    RowMatrix gradient(count, size);
    double* gradient_data = gradient.data();
    if (!closures_[i]->Evaluate(&parameters[i], &h[first], wanted ? &gradient_data : nullptr)) {
      return false;
    }
    if (wanted) {
      Eigen::Map<RowMatrix>(jacobians[i], h.size(), size) =
          whitening_.middleCols(first, count) * gradient;
    }
    first += count;
  }
  Eigen::Map<Vector>(residuals, h.size()) = whitening_ * h;
  return true;
}

}  // namespace symkin
