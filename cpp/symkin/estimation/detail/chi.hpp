// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>

#include "symkin/estimation/robust_loss.hpp"

namespace symkin {

// E[f(d); d < limit] of d ~ chi_k, f smooth on both sides of `bend`.
template <typename Function>
double chi_expectation(Index degrees, double bend, const Function& function,
                       double limit = std::numeric_limits<double>::infinity()) {
  constexpr int kPanels = 12;
  constexpr double kBeyond = 12;  // standard deviations above the mean that matter
  const auto k = static_cast<double>(degrees);
  const double log_norm = (k / 2 - 1) * std::log(2.0) + std::lgamma(k / 2);
  const auto density = [&](double d) {
    return std::exp((k - 1) * std::log(d) - d * d / 2 - log_norm);
  };
  const double end = std::min(limit, std::sqrt(k) + kBeyond);
  double sum = 0;
  const auto add = [&](double from, double to) {
    for (int panel = 0; panel < kPanels; ++panel) {
      const double step = (to - from) / kPanels;
      sum += boost::math::quadrature::gauss<double, 20>::integrate(
          [&](double d) { return function(d) * density(d); }, from + panel * step,
          from + (panel + 1) * step);
    }
  };
  add(0, std::min(bend, end));
  if (bend < end) {
    add(bend, end);
  }
  return sum;
}

// Of d ~ chi_k that is below a limit: how often it is, mean and variance of d^2.
inline BlockLoss::Kept chi_below(Index degrees, double limit) {
  const auto k = static_cast<double>(degrees);
  const double half = limit * limit / 2;
  const double share = boost::math::gamma_p(k / 2, half);
  const double mean = k * boost::math::gamma_p(k / 2 + 1, half) / share;
  const double square = k * (k + 2) * boost::math::gamma_p(k / 2 + 2, half) / share;
  return {limit, share, mean, square - mean * mean, 1};
}

}  // namespace symkin
