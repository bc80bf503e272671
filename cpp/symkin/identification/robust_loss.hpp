// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

namespace ceres {
class LossFunction;
}

namespace symkin {

// Loss on the standardised residual, linear or flat beyond `scale` standard deviations.
struct RobustLoss {
  enum class Kind { none, huber, cauchy, tukey };
  Kind kind = Kind::none;
  // Zero stands for the scale at which the loss keeps 95% efficiency on normal residuals: 1.345
  // (huber), 2.385 (cauchy), 4.685 (tukey).
  double scale = 0;

  void check() const;  // throws InvalidInput
  // For residuals that are `spread` times larger than standard normal ones; null for none.
  std::unique_ptr<ceres::LossFunction> make(double spread = 1) const;
  // The weight that the loss gives a standardised residual, 1 for none.
  double weight(double residual, double spread = 1) const;
};

}  // namespace symkin
