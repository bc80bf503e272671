// SPDX-License-Identifier: MIT
#include "symkin/estimation/robust_loss.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "symkin/support/error.hpp"

namespace symkin {

void RobustLoss::check() const {
  if (!(scale >= 0)) {
    throw InvalidInput(
        "loss scale = " + std::to_string(scale) +
        "; expected a positive number of standard deviations, or 0 for the usual one");
  }
}

double RobustLoss::width(double spread) const {
  const double usual = kind == Kind::huber ? 1.345 : kind == Kind::cauchy ? 2.385 : 4.685;
  return (scale > 0 ? scale : usual) * spread;
}

RobustLoss::Value RobustLoss::evaluate(double square, double spread) const {
  const double bend = width(spread) * width(spread);
  const double u = square / bend;
  switch (kind) {
    case Kind::none:
      break;
    case Kind::huber:
      if (u > 1) {
        const double root = std::sqrt(u);
        return {bend * (2 * root - 1), 1 / root};
      }
      break;
    case Kind::cauchy:
      return {bend * std::log1p(u), 1 / (1 + u)};
    case Kind::tukey: {
      const double inside = std::max(1 - u, 0.0);
      return {bend / 3 * (1 - inside * inside * inside), inside * inside};
    }
  }
  return {square, 1};
}

double RobustLoss::spread(const Vector& standardised) const {
  constexpr double kNormalMedian = 0.6744897501960817;  // of |standard normal|
  if (kind == Kind::none) {
    return 1;
  }
  std::vector<double> magnitudes(standardised.data(), standardised.data() + standardised.size());
  for (double& value : magnitudes) {
    value = std::abs(value);
  }
  const auto middle = magnitudes.begin() + standardised.size() / 2;
  std::nth_element(magnitudes.begin(), middle, magnitudes.end());
  return std::max(1.0, *middle / kNormalMedian);
}

}  // namespace symkin
