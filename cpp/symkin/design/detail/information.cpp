// SPDX-License-Identifier: MIT
#include "symkin/design/detail/information.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kSmallestPivot = 1e-6;  // of 1 + weight d: less costs more than six digits
constexpr int kUpdatesKept = 32;
}  // namespace

void Information::reset(RowMatrix matrix) {
  matrix_ = std::move(matrix);
  refresh();
}

void Information::refresh() {
  updates_ = 0;
  const RowMatrix factor = inverse_factor(matrix_);
  positive_definite_ = factor.size() != 0;
  if (positive_definite_) {
    inverse_ = product(factor.transpose(), factor);
    log_det_ = log_determinant(factor);
  } else {
    inverse_.setConstant(matrix_.rows(), matrix_.cols(), std::numeric_limits<double>::quiet_NaN());
    log_det_ = -kInfinity;
  }
}

InverseChange Information::add(const double* rows, Index count, double weight) {
  InverseChange change{RowMatrix(count, matrix_.rows()), Vector(count)};
  auto& [u, scale] = change;
  for (Index row = 0; row < count; ++row) {
    const Eigen::Map<const Vector> x(rows + row * matrix_.rows(), matrix_.rows());
    Eigen::Map<Vector> work(u.row(row).data(), matrix_.rows());
    work.noalias() = inverse_ * x;
    const double pivot = 1 + weight * x.dot(work);
    scale[row] = -weight / pivot;
    matrix_.noalias() += (weight * x) * x.transpose();
    if (!positive_definite_ || ++updates_ > kUpdatesKept || !(pivot > kSmallestPivot)) {
      refresh();
      continue;
    }
    inverse_.noalias() += (scale[row] * work) * work.transpose();
    log_det_ += std::log(pivot);
  }
  return change;
}

}  // namespace symkin::design::detail
