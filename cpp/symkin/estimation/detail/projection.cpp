// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/projection.hpp"

#include <cmath>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {

Projection::Projection(const WhitenedClosures& system, const std::vector<bool>& left_out)
    : system_(system), left_out_(left_out), residual_(kept(system.residual)) {
  const RowMatrix jacobian = kept(system.jacobian);
  Index count = 0;
  for (std::size_t k = 0; k < system.poses.size(); ++k) {
    count += left_out_[k] ? 0 : system.poses[k].count();
  }
  const Vector scale = inverse_column_lengths(jacobian);
  const ColumnSpace space = column_space(jacobian * scale.asDiagonal());
  basis_ = space.basis;
  leverages_ = product(system.jacobian, scale.asDiagonal() * space.coordinates);
  explained_ = basis_.transpose() * residual_;
  residual_ -= basis_ * explained_;
  degrees_of_freedom_ = count - space.rank();
}

RowMatrix Projection::kept(RowMatrix rows) const {
  for (std::size_t k = 0; k < system_.poses.size(); ++k) {
    if (left_out_[k]) {
      rows.middleRows(system_.poses[k].first, system_.poses[k].count()).setZero();
    }
  }
  return rows;
}

RowMatrix Projection::unexplained(RowMatrix terms) const {
  terms = kept(std::move(terms));
  terms -= product(basis_, product(basis_.transpose(), terms));
  return terms;
}

std::pair<Vector, RowMatrix> Projection::predicted(std::size_t pose) const {
  const WhitenedPose& which = system_.poses[pose];
  const Index n = which.count();
  const auto leverage = leverages_.middleRows(which.first, n);
  const RowMatrix explained = product(leverage, leverage.transpose());
  const RowMatrix one = RowMatrix::Identity(n, n);
  if (left_out_[pose]) {
    return {system_.residual.segment(which.first, n) - leverage * explained_, one + explained};
  }
  // (I - H)^-1 e has the covariance (I - H)^-1.
  const RowMatrix open = symmetric_inverse(one - explained).matrix;
  return {open * residual_.segment(which.first, n), open};
}

double Projection::quadratic_form(const std::vector<std::pair<Index, Index>>& pairs) const {
  double value = 0;
  RowMatrix moved = RowMatrix::Zero(basis_.rows(), basis_.cols());  // M Q
  for (const auto& [a, b] : pairs) {
    value += residual_[a] * residual_[b];
    moved.row(a) += basis_.row(b) / 2;
    moved.row(b) += basis_.row(a) / 2;
  }
  // Moments of e'Me / e'e, from the traces of MR and (MR)^2 with R = I - QQ'.
  const auto n = static_cast<double>(degrees_of_freedom_);
  const RowMatrix inner = product(basis_.transpose(), moved);
  const double trace = -inner.trace();
  const double square =
      static_cast<double>(pairs.size()) / 2 - 2 * moved.squaredNorm() + inner.squaredNorm();
  const double variance = 2 * (n * square - trace * trace) / (n * n * (n + 2));
  return (value / chi_square() - trace / n) / std::sqrt(variance);
}

}  // namespace symkin
