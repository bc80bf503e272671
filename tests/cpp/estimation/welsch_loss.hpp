// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/loss_function.h>

#include <cmath>
#include <memory>

#include "symkin/estimation/robust_loss.hpp"

namespace symkin::testing {

// Welsch's, which nobody registered: a loss of a user's own.
class WelschLoss final : public ceres::LossFunction {
 public:
  explicit WelschLoss(double bend) : square_(bend * bend) {}
  void Evaluate(double s, double* rho) const override {
    const double left = std::exp(-s / square_);
    rho[0] = square_ * (1 - left);
    rho[1] = left;
    rho[2] = -left / square_;
  }

 private:
  double square_;
};

inline LossFamily welsch() {
  return {"welsch", LossFamily::Start::cauchy,
          [](double bend) -> std::unique_ptr<ceres::LossFunction> {
            return std::make_unique<WelschLoss>(bend);
          }};
}

}  // namespace symkin::testing
