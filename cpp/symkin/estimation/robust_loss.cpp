// SPDX-License-Identifier: MIT
#include "symkin/estimation/robust_loss.hpp"

#include <ceres/loss_function.h>

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

std::unique_ptr<ceres::LossFunction> RobustLoss::make(double spread) const {
  const auto width = [&](double usual) { return (scale > 0 ? scale : usual) * spread; };
  switch (kind) {
    case Kind::none:
      break;
    case Kind::huber:
      return std::make_unique<ceres::HuberLoss>(width(1.345));
    case Kind::cauchy:
      return std::make_unique<ceres::CauchyLoss>(width(2.385));
    case Kind::tukey:
      return std::make_unique<ceres::TukeyLoss>(width(4.685));
  }
  return nullptr;
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

double RobustLoss::weight(double residual, double spread) const {
  const auto loss = make(spread);
  if (loss == nullptr) {
    return 1;
  }
  double rho[3];
  loss->Evaluate(residual * residual, rho);
  return rho[1];
}

}  // namespace symkin
