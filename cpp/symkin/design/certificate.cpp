// SPDX-License-Identifier: MIT
#include "symkin/design/certificate.hpp"

#include <algorithm>
#include <cmath>

#include "symkin/design/information.hpp"

namespace symkin {

void Certificate::compare(double log_det, Index parameters) {
  const auto p = static_cast<double>(parameters);
  // The optimum is itself a bound; rounding may not make an efficiency exceed one.
  efficiency_repeats = std::min(1.0, std::exp((log_det - log_det_bound_repeats) / p));
  efficiency_distinct = std::min(1.0, std::exp((log_det - log_det_bound_distinct) / p));
}

double determinant_bound(const RowMatrix& transform, double trace) {
  const Index p = transform.rows();
  const auto size = static_cast<double>(p);
  // |fl(T x) - T x| <= p eps |T| |x| <= p eps (|T| |T^-1|) |T x|, component by component: the
  // relative error of d = |T x|^2 and of the sums is below this slack.
  RowMatrix inverse = RowMatrix::Identity(p, p);
  transform.triangularView<Eigen::Lower>().solveInPlace(inverse);
  const double growth = (transform.cwiseAbs() * inverse.cwiseAbs()).rowwise().sum().maxCoeff();
  const double epsilon = std::numeric_limits<double>::epsilon();
  const double slack = 8 * (size + 4) * epsilon * std::sqrt(size) * growth + 64 * epsilon;
  const double log_det = log_determinant(transform);
  const double bound = log_det + size * (std::log(trace / size) + slack);
  return bound + 16 * epsilon * (std::abs(log_det) + std::abs(bound));
}

double fixed_trace(const RowMatrix& transform, const RowMatrix& fixed) {
  return (transform * fixed).cwiseProduct(transform).sum();
}

}  // namespace symkin
