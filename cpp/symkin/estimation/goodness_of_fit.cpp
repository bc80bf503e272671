// SPDX-License-Identifier: MIT
#include "symkin/estimation/goodness_of_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/information.hpp"
#include "symkin/estimation/detail/projection.hpp"
#include "symkin/estimation/detail/statistics.hpp"
#include "symkin/estimation/robust_loss.hpp"

namespace symkin {

GoodnessOfFit judged(std::vector<Index> legs, double chi_square, Index degrees_of_freedom,
                     Index problems) {
  constexpr double kFalseAlarms = 1e-3;
  GoodnessOfFit fit;
  fit.legs = std::move(legs);
  fit.chi_square = chi_square;
  fit.degrees_of_freedom = degrees_of_freedom;
  if (fit.degrees_of_freedom > 0) {
    const double alarms = kFalseAlarms / static_cast<double>(problems);
    fit.limit = chi_square_limit(fit.degrees_of_freedom, alarms);
    fit.least = chi_square_limit(fit.degrees_of_freedom, 1 - alarms);
  } else {
    fit.limit = fit.least = std::numeric_limits<double>::quiet_NaN();
  }
  return fit;
}

double GoodnessOfFit::spread() const {
  return unexplained() ? std::sqrt(chi_square / static_cast<double>(degrees_of_freedom)) : 1;
}

GoodnessOfFit goodness_of_fit(const WhitenedClosures& system, const Vector& weights,
                              Index problems) {
  std::vector<bool> rejected;
  for (Index k = 0; k < weights.size(); ++k) {
    rejected.push_back(weights[k] < kRejectedWeight);
  }
  const Projection projection(system, rejected);
  return judged(system.legs, projection.chi_square(), projection.degrees_of_freedom(), problems);
}

GoodnessOfFit goodness_of_fit(Index leg, const Vector& standardised, const Information& information,
                              Index closures, Index problems) {
  const double unexplained = standardised.squaredNorm() - information.explained(standardised);
  return judged({leg}, std::max(unexplained, 0.0), closures - information.rank(), problems);
}

}  // namespace symkin
