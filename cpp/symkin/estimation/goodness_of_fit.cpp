// SPDX-License-Identifier: MIT
#include "symkin/estimation/goodness_of_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/statistics/distributions.hpp"

namespace symkin {

GoodnessOfFit judged(std::vector<Index> legs, double chi_square, double degrees_of_freedom,
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
  return unexplained() ? std::sqrt(chi_square / degrees_of_freedom) : 1;
}

GoodnessOfFit goodness_of_fit(Index leg, const Vector& standardised, const LinearFit& linear,
                              Index closures, Index problems) {
  const double unexplained = standardised.squaredNorm() - linear.explained(standardised);
  return judged({leg}, std::max(unexplained, 0.0), static_cast<double>(closures - linear.rank()),
                problems);
}

}  // namespace symkin
