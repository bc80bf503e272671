// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/information.hpp"

#include <cmath>
#include <limits>

#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

// With such pivots the normal equations lose half of the digits at most.
constexpr double kClear = 1e-7;
constexpr double kRank = 1e-10;  // singular values of what is seen, of the largest
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void Information::reset(const RowMatrix& by_parameters, const Vector& factors) {
  by_parameters_ = &by_parameters;
  factors_ = factors;
  weighted_square(by_parameters, factors.cwiseAbs2(), square_);
  cholesky_.compute(square_);
  look_closer();
}

void Information::reset(const RowMatrix& by_parameters, const Vector& factors,
                        const RowMatrix& square, const ScaledCholesky& cholesky) {
  by_parameters_ = &by_parameters;
  factors_ = factors;
  square_ = square;
  cholesky_ = cholesky;
  look_closer();
}

void Information::look_closer() {
  if (!clear()) {
    space_ = column_space(rows() * cholesky_.scale().asDiagonal());
  }
}

bool Information::is_clear(double least_pivot) { return least_pivot > kClear; }

RowMatrix Information::inverse() const {
  if (clear()) {
    return cholesky_.inverse();
  }
  const Index p = square_.rows();
  if (space_.rank() < p) {
    return RowMatrix::Constant(p, p, kInfinity);
  }
  const RowMatrix half = cholesky_.scale().asDiagonal() * space_.coordinates;
  return product(half, half.transpose());
}

Vector Information::inverse_diagonal() const {
  return clear() ? cholesky_.inverse_diagonal() : Vector(inverse().diagonal());
}

double Information::explained(const Vector& residual) const {
  if (clear()) {
    return cholesky_.inverse_form(by_parameters_->transpose() * factors_.cwiseProduct(residual));
  }
  return (space_.basis.transpose() * residual).squaredNorm();
}

Information::Sight Information::sight() const {
  const Index p = square_.rows();
  const Vector& scale = cholesky_.scale();
  if (clear()) {
    const Vector values = symmetric_eigenvalues(scale.asDiagonal() * square_ * scale.asDiagonal());
    return {std::sqrt(values[p - 1] / values[0]), RowMatrix(p, 0)};
  }
  if (!square_.allFinite()) {
    return {kInfinity, RowMatrix(p, 0)};
  }
  const RightSingular svd = right_singular(rows() * scale.asDiagonal());
  const Vector& singular = svd.values;
  const Index rank = (singular.array() > kRank * singular[0]).count();
  return {rank < p ? kInfinity : singular[0] / singular[p - 1],
          named_directions(svd.vectors.rightCols(p - rank), scale)};
}

}  // namespace symkin
