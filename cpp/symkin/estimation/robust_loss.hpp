// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// A pose whose weight falls below this is called rejected.
inline constexpr double kRejectedWeight = 0.5;

// Loss on the standardised residual, linear or flat beyond `scale` standard deviations.
struct RobustLoss {
  enum class Kind { none, huber, cauchy, tukey };
  Kind kind = Kind::none;
  // Zero stands for the scale at which the loss keeps 95% efficiency on normal residuals: 1.345
  // (huber), 2.385 (cauchy), 4.685 (tukey).
  double scale = 0;

  void check() const;  // throws InvalidInput
  // Of a squared residual: what it adds to the cost, and the derivative of that, its weight.
  struct Value {
    double cost, weight;
  };
  Value evaluate(double square, double spread = 1) const;
  // How much larger than standard normal the bulk of the residuals is, at least 1 (and 1 without a
  // loss): the median absolute value over that of a standard normal. Keeps the loss from rejecting
  // everything where the declared noise is too small.
  double spread(const Vector& standardised) const;

 private:
  // Where it bends, for residuals that are `spread` times larger than standard normal ones.
  double width(double spread) const;
};

}  // namespace symkin
