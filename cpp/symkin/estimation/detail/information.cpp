// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/information.hpp"

#include <cmath>
#include <limits>

namespace symkin {
namespace {

// Of a squared column, what the columns before it leave: the normal equations then lose half of the
// digits at most.
constexpr double kClear = 1e-7;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Information::Information(const RowMatrix& rows) : rows_(rows) {
  gram_.noalias() = rows.transpose() * rows;
  scale_ = (gram_.diagonal().array() > 0).select(gram_.diagonal().array().sqrt().inverse(), 1);
  gram_ = scale_.asDiagonal() * gram_ * scale_.asDiagonal();
  root_ = inverse_factor(gram_);
  // The diagonal of the factor's inverse has one over the pivots.
  clear_ = root_.size() > 0 && root_.diagonal().array().square().maxCoeff() < 1 / kClear;
}

Index Information::rank() const { return clear_ ? rows_.cols() : space().rank(); }

RowMatrix Information::inverse() const {
  const Index p = rows_.cols();
  if (clear_) {
    const RowMatrix half = root_ * scale_.asDiagonal();
    return half.transpose() * half;
  }
  if (space().rank() < p) {
    return RowMatrix::Constant(p, p, kInfinity);
  }
  const RowMatrix half = scale_.asDiagonal() * space().coordinates;
  return half * half.transpose();
}

double Information::explained(const Vector& residual) const {
  if (clear_) {
    const Vector along = scale_.cwiseProduct(rows_.transpose() * residual);
    return (root_ * along).squaredNorm();
  }
  return (space().basis.transpose() * residual).squaredNorm();
}

double Information::condition() const {
  if (clear_) {
    const Vector values = symmetric_eigenvalues(gram_);
    return std::sqrt(values[values.size() - 1] / values[0]);
  }
  return kInfinity;
}

const ColumnSpace& Information::space() const {
  if (!space_) {
    space_ = column_space(rows_ * scale_.asDiagonal());
  }
  return *space_;
}

}  // namespace symkin
