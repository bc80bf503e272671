// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/linear_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

// With such pivots the normal equations lose half of the digits at most.
constexpr double kClear = 1e-7;
constexpr double kRank = 1e-9;  // singular values of what is seen, of the largest
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

NullSpace null_space(const RowMatrix& rows, const Vector& scale) {
  const Index p = rows.cols();
  RowMatrix tall = RowMatrix::Zero(std::max(rows.rows(), p), p);
  tall.topRows(rows.rows()) = rows * scale.asDiagonal();
  const RightSingular svd = right_singular(triangular_factor(tall));
  const Vector& singular = svd.values;
  const Index rank = p == 0 ? 0 : (singular.array() > kRank * singular[0]).count();
  return {rank < p ? kInfinity
          : p == 0 ? 1
                   : singular[0] / singular[p - 1],
          svd.vectors.rightCols(p - rank)};
}

void LinearFit::reset(const RowMatrix& by_parameters, const Vector& factors) {
  by_parameters_ = &by_parameters;
  factors_ = factors;
  weighted_square(by_parameters, factors.cwiseAbs2(), square_);
  cholesky_.compute(square_);
  if (!clear()) {
    space_ = column_space(rows() * cholesky_.scale().asDiagonal());
  }
}

bool LinearFit::is_clear(double least_pivot) { return least_pivot > kClear; }

RowMatrix LinearFit::covariance() const {
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

Vector LinearFit::variances() const {
  return clear() ? cholesky_.inverse_diagonal() : Vector(covariance().diagonal());
}

Vector LinearFit::leverages() const {
  if (!clear()) {
    return space_.basis.rowwise().squaredNorm();
  }
  const RowMatrix own = rows();
  return product(own, cholesky_.inverse()).cwiseProduct(own).rowwise().sum();
}

double LinearFit::explained(const Vector& residual) const {
  if (clear()) {
    return cholesky_.inverse_form(by_parameters_->transpose() * factors_.cwiseProduct(residual));
  }
  return (space_.basis.transpose() * residual).squaredNorm();
}

LinearFit::Conditioning LinearFit::conditioning() const {
  const Index p = square_.rows();
  const Vector& scale = cholesky_.scale();
  if (clear()) {
    const Vector values = symmetric_eigenvalues(scale.asDiagonal() * square_ * scale.asDiagonal());
    return {std::sqrt(values[p - 1] / values[0]), RowMatrix(p, 0)};
  }
  if (!square_.allFinite()) {
    return {kInfinity, RowMatrix(p, 0)};
  }
  const NullSpace null = null_space(rows(), scale);
  return {null.condition, named_directions(null.directions, scale)};
}

}  // namespace symkin
