// SPDX-License-Identifier: MIT
#include "symkin/statistics/distributions.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace symkin {

double chi_square_limit(double degrees_of_freedom, double probability) {
  constexpr std::size_t kMost = 10000;
  // A fleet asks for the same few limits again and again.
  thread_local std::map<std::pair<double, double>, double> known;
  if (known.size() > kMost) {
    known.clear();
  }
  const auto [limit, is_new] = known.try_emplace({degrees_of_freedom, probability}, 0);
  if (is_new) {
    const boost::math::chi_squared distribution(degrees_of_freedom);
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
  const boost::math::chi_squared distribution(degrees_of_freedom);
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

}  // namespace symkin
