// SPDX-License-Identifier: MIT
#include "symkin/statistics/distributions.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// Boost divides by a gamma function that overflows from some 3500 degrees of freedom on where the
// value is far below: the share is zero then, and nothing went wrong.
using ChiSquared = boost::math::chi_squared_distribution<
    double, boost::math::policies::policy<
                boost::math::policies::overflow_error<boost::math::policies::ignore_error>>>;

}  // namespace

double chi_square_limit(double degrees_of_freedom, double probability) {
  constexpr std::size_t kMost = 10000;
  // A fleet asks for the same few limits again and again.
  thread_local std::map<std::pair<double, double>, double> known;
  if (known.size() > kMost) {
    known.clear();
  }
  const auto [limit, is_new] = known.try_emplace({degrees_of_freedom, probability}, 0);
  if (is_new) {
    const ChiSquared distribution(degrees_of_freedom);
    limit->second = boost::math::quantile(boost::math::complement(distribution, probability));
  }
  return limit->second;
}

double student_limit(double probability, double degrees_of_freedom) {
  if (std::isinf(degrees_of_freedom)) {
    return boost::math::quantile(
        boost::math::complement(boost::math::normal_distribution<>(), probability / 2));
  }
  return degrees_of_freedom > 0 ? boost::math::quantile(boost::math::complement(
                                      boost::math::students_t(degrees_of_freedom), probability / 2))
                                : std::numeric_limits<double>::infinity();
}

double chi_square_tail(double value, double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0) || std::isnan(value)) {
    return 1;
  }
  const ChiSquared distribution(degrees_of_freedom);
  return std::isinf(value)
             ? 0
             : boost::math::cdf(boost::math::complement(distribution, std::max(value, 0.0)));
}

double f_tail(double value, Index numerator, Index denominator) {
  if (numerator < 1 || denominator < 1 || std::isnan(value)) {
    return 1;
  }
  if (std::isinf(value)) {
    return 0;
  }
  const boost::math::fisher_f distribution(static_cast<double>(numerator),
                                           static_cast<double>(denominator));
  return boost::math::cdf(boost::math::complement(distribution, std::max(value, 0.0)));
}

double normal_tails(double value) { return std::erfc(std::abs(value) / std::sqrt(2.0)); }

double student_tails(double value, Index degrees_of_freedom) {
  return f_tail(value * value, 1, degrees_of_freedom);
}

namespace {

// Beyond it Boost's sum is long, and at last overflows; Sankaran's power is within 3e-9.
constexpr double kFarFromCentral = 1e7;

// Sankaran (1963), Biometrika 50, 199: a power of the variable is nearly normal.
double sankaran(double value, double degrees, double noncentrality) {
  const double mean = degrees + noncentrality;
  const double slope = degrees + 2 * noncentrality;
  const double h = 1 - 2 * mean * (degrees + 3 * noncentrality) / (3 * slope * slope);
  const double p = slope / (mean * mean);
  const double m = (h - 1) * (1 - 3 * h);
  const double centre = 1 + h * p * (h - 1 - 0.5 * (2 - h) * m * p);
  const double width = h * std::sqrt(2 * p * (1 + 0.5 * m * p));
  return boost::math::cdf(boost::math::normal_distribution<>(),
                          (std::pow(value / mean, h) - centre) / width);
}

}  // namespace

double noncentral_chi_square(double value, double degrees_of_freedom, double noncentrality) {
  if (!(degrees_of_freedom > 0 && noncentrality >= 0 && value >= 0)) {
    throw InvalidInput(
        "a noncentral chi-square has degrees above zero, and neither a noncentrality nor a value "
        "below");
  }
  if (noncentrality > kFarFromCentral) {
    return sankaran(value, degrees_of_freedom, noncentrality);
  }
  // Boost's sum over the two does not take a noncentrality of zero.
  return noncentrality > 0
             ? boost::math::cdf(
                   boost::math::non_central_chi_squared(degrees_of_freedom, noncentrality), value)
             : boost::math::cdf(ChiSquared(degrees_of_freedom), value);
}

}  // namespace symkin
