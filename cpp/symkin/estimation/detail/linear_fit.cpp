// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/linear_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

constexpr double kClear = 1e-7;  // pivots with which half of the digits are lost at most
constexpr double kRank = 1e-9;   // singular values of what is seen, of the largest
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Vector WhitenedSystem::squares(const Vector& change) const {
  const Vector after = residual.head(rows()) + jacobian.topRows(rows()) * change;
  Vector squares(count());
  for (Index i = 0; i < count(); ++i) {
    squares[i] = after.segment(first[static_cast<std::size_t>(i)], conditions(i)).squaredNorm();
  }
  return squares;
}

bool LinearFit::is_clear(double least_pivot) { return least_pivot > kClear; }

void LinearFit::reset(const RowMatrix& by_parameters, const Vector& factors) {
  by_parameters_ = &by_parameters;
  factors_ = factors;
  weighted_square(by_parameters, factors.cwiseAbs2(), square_);
  cholesky_.compute(square_);
  least_pivot_ = cholesky_.least_pivot();
  unseen_.resize(square_.rows(), 0);
  if (!clear()) {
    look(cholesky_.scale(), [this] { return rows(); });
  }
}

LinearFit::LinearFit(RowMatrix square, const Vector& sizes, const std::function<RowMatrix()>& rows,
                     bool by_rows, const ScaledCholesky* known)
    : square_(std::move(square)), unseen_(square_.rows(), 0) {
  known != nullptr ? void(cholesky_ = *known) : cholesky_.compute(square_);
  least_pivot_ = cholesky_.least_pivot();
  if (clear()) {
    return;
  }
  const std::optional<RowMatrix> null = by_rows ? std::nullopt : clear_null_space(square_, kClear);
  if (null && null->cols() > 0) {
    // With what is unseen added as if it were seen, which no covariance() keeps.
    sizes_ = sizes;
    unseen_ = column_space(sizes_.cwiseInverse().asDiagonal() * *null).basis;
    const double size = square_.diagonal().dot(sizes_.cwiseAbs2()) / static_cast<double>(rank());
    const RowMatrix added = sizes_.cwiseInverse().asDiagonal() * unseen_;
    cholesky_.compute(square_ + size * product(added, added.transpose()));
    if (is_clear(cholesky_.least_pivot())) {
      return;
    }
  }
  look(sizes, rows);
}

void LinearFit::look(const Vector& sizes, const std::function<RowMatrix()>& rows) {
  const Index p = square_.rows();
  sizes_ = sizes;
  half_.resize(p, 0);
  condition_ = kInfinity;
  if (!square_.allFinite()) {
    return;
  }
  const RowMatrix made = rows();
  RowMatrix tall = RowMatrix::Zero(std::max(made.rows(), p), p);
  tall.topRows(made.rows()) = made * sizes.asDiagonal();
  const auto [singular, vectors] = right_singular(triangular_factor(tall));
  const Index rank = p == 0 ? 0 : (singular.array() > kRank * singular[0]).count();
  unseen_ = vectors.rightCols(p - rank);
  half_ =
      sizes.asDiagonal() * vectors.leftCols(rank) * singular.head(rank).cwiseInverse().asDiagonal();
  if (rank == p) {
    condition_ = p == 0 ? 1 : singular[0] / singular[p - 1];
  }
}

RowMatrix LinearFit::named_unseen() const { return named_directions(unseen_, sizes_); }

double LinearFit::condition() const {
  if (!clear()) {
    return condition_;
  }
  const Vector& scale = cholesky_.scale();
  const Vector values = symmetric_eigenvalues(scale.asDiagonal() * square_ * scale.asDiagonal());
  return std::sqrt(values[values.size() - 1] / values[0]);
}

RowMatrix LinearFit::covariance(const RowMatrix& held) const {
  if (clear()) {
    return cholesky_.inverse();
  }
  const Index p = square_.rows();
  if (std::isinf(condition_) && held.rows() == 0) {
    return RowMatrix::Constant(p, p, kInfinity);
  }
  RowMatrix any = half_.rows() > 0 ? product(half_, half_.transpose()) : cholesky_.inverse();
  if (unseen_.cols() == 0) {
    return any;
  }
  const RowMatrix along = sizes_.asDiagonal() * unseen_;
  const RowMatrix onto =
      RowMatrix::Identity(p, p) - product(product(along, inverse(product(held, along))), held);
  return product(product(onto, any), onto.transpose());
}

RowMatrix LinearFit::influence() const {
  return product(covariance(), by_parameters_->transpose()) * factors_.cwiseAbs2().asDiagonal();
}

Vector LinearFit::leverages() const {
  const RowMatrix own = rows();
  if (!clear()) {
    return product(own, half_).rowwise().squaredNorm();
  }
  return product(own, cholesky_.inverse()).cwiseProduct(own).rowwise().sum();
}

double LinearFit::explained(const Vector& residual) const {
  const Vector along = by_parameters_->transpose() * factors_.cwiseProduct(residual);
  return clear() ? cholesky_.inverse_form(along) : (half_.transpose() * along).squaredNorm();
}

}  // namespace symkin
