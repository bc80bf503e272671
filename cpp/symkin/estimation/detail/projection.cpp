// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/projection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Of a diagonal of ones. With such pivots one step of Cholesky leaves columns that are orthogonal
// to 1e-7 at least, and another to the last digit.
constexpr double kClear = 1e-9;

// The triangular X with which (A X)'(A X) = 1, A'A given; empty if that is too nearly singular.
RowMatrix orthogonalising(const RowMatrix& square) {
  const Vector diagonal = square.diagonal();
  const Vector scale = (diagonal.array() > 0).select(diagonal, 1).cwiseSqrt().cwiseInverse();
  const RowMatrix factor = cholesky_factor(scale.asDiagonal() * square * scale.asDiagonal());
  if (factor.size() == 0 || !(factor.diagonal().cwiseAbs2().minCoeff() > kClear)) {
    return {};
  }
  return scale.asDiagonal() * lower_inverse(factor).transpose();
}

}  // namespace

Projection::Projection(const WhitenedClosures& system, std::vector<bool> left_out)
    : system_(system),
      closures_(system.poses.empty() ? 1 : system.poses.front().closures),
      left_out_(std::move(left_out)),
      residual_(system.residual) {
  find_legs();
  if (!orthogonalise()) {
    orthogonalise_anyhow();
  }
  Index count = 0;
  for (std::size_t k = 0; k < system.poses.size(); ++k) {
    const WhitenedPose& pose = system.poses[k];
    count += left_out_[k] ? 0 : pose.count();
    if (left_out_[k]) {
      residual_.segment(pose.first, pose.count()).setZero();
    }
  }
  explained_ = Vector::Zero(rank());
  for (const LegBlock& leg : legs_) {
    explained_.tail(leg.basis.cols()) += leg.basis.transpose() * residual_(leg.rows);
  }
  for (const LegBlock& leg : legs_) {
    residual_(leg.rows) -= leg.basis * explained_.tail(leg.basis.cols());
  }
  degrees_of_freedom_ = count - rank();
}

void Projection::find_legs() {
  legs_.resize(system_.legs.size());
  places_.resize(static_cast<std::size_t>(system_.residual.size()));
  for (std::size_t k = 0; k < system_.poses.size(); ++k) {
    const WhitenedPose& pose = system_.poses[k];
    for (Index i = 0; i < pose.count(); ++i) {
      const Index leg = pose.legs[static_cast<std::size_t>(i / pose.closures)];
      LegBlock& block = legs_[static_cast<std::size_t>(system_.position(leg))];
      if (i % pose.closures == 0) {
        block.poses.push_back(static_cast<Index>(k));
      }
      places_[static_cast<std::size_t>(pose.first + i)] = static_cast<Index>(block.rows.size());
      block.rows.push_back(pose.first + i);
    }
  }
}

void Projection::leave_out(const LegBlock& leg, RowMatrix& rows) const {
  for (std::size_t k = 0; k < leg.poses.size(); ++k) {
    if (!counts(leg.poses[k])) {
      rows.middleRows(static_cast<Index>(k) * closures_, closures_).setZero();
    }
  }
}

bool Projection::orthogonalise() {
  const Index p = system_.columns.back();
  std::vector<Index> order;  // of the columns, the last leg's first
  for (std::size_t leg = legs_.size(); leg-- > 0;) {
    for (Index i = system_.columns[leg]; i < system_.columns[leg + 1]; ++i) {
      order.push_back(i);
    }
  }
  for (std::size_t leg = 0; leg < legs_.size(); ++leg) {
    const Index width = system_.columns[leg + 1];
    const std::vector<Index> own(order.end() - width, order.end());
    legs_[leg].basis = system_.jacobian(legs_[leg].rows, own);
    leave_out(legs_[leg], legs_[leg].basis);
  }
  RowMatrix all = RowMatrix::Identity(p, p);
  for (int pass = 0; pass < 2; ++pass) {
    RowMatrix square = RowMatrix::Zero(p, p);
    for (const LegBlock& leg : legs_) {
      const Index width = leg.basis.cols();
      square.bottomRightCorner(width, width) += product(leg.basis.transpose(), leg.basis);
    }
    const RowMatrix step = orthogonalising(square);
    if (step.size() == 0) {
      return false;
    }
    for (LegBlock& leg : legs_) {
      const Index width = leg.basis.cols();
      leg.basis = product(leg.basis, step.bottomRightCorner(width, width));
    }
    all = product(all, step);
  }
  coordinates_.resize(p, p);
  coordinates_(order, kAll) = all;
  return true;
}

void Projection::orthogonalise_anyhow() {
  RowMatrix jacobian = system_.jacobian;
  for (std::size_t k = 0; k < system_.poses.size(); ++k) {
    if (left_out_[k]) {
      jacobian.middleRows(system_.poses[k].first, system_.poses[k].count()).setZero();
    }
  }
  const Vector scale = inverse_column_lengths(jacobian);
  const ColumnSpace space = column_space(jacobian * scale.asDiagonal());
  coordinates_ = scale.asDiagonal() * space.coordinates;
  for (LegBlock& leg : legs_) {
    leg.basis = space.basis(leg.rows, kAll);
  }
}

RowMatrix Projection::rows_of_basis(const WhitenedPose& pose, bool counts) const {
  if (!counts) {
    return product(system_.jacobian.middleRows(pose.first, pose.count()), coordinates_);
  }
  RowMatrix rows = RowMatrix::Zero(pose.count(), rank());
  for (Index i = 0; i < pose.count(); ++i) {
    const Index leg = system_.position(pose.legs[static_cast<std::size_t>(i / closures_)]);
    const RowMatrix& basis = legs_[static_cast<std::size_t>(leg)].basis;
    rows.row(i).tail(basis.cols()) = basis.row(places_[static_cast<std::size_t>(pose.first + i)]);
  }
  return rows;
}

Projection::Prediction Projection::predicted(Index pose) const {
  constexpr double kPoorPivot = 1e-8;
  const WhitenedPose& which = system_.poses[static_cast<std::size_t>(pose)];
  const Index n = which.count();
  const RowMatrix leverage = rows_of_basis(which, counts(pose));
  const RowMatrix explained = product(leverage, leverage.transpose());
  const RowMatrix one = RowMatrix::Identity(n, n);
  if (!counts(pose)) {
    const Vector error = system_.residual.segment(which.first, n) - leverage * explained_;
    const RowMatrix inverse = symmetric_inverse(one + explained).matrix;
    const Vector standardised = inverse * error;
    return {standardised, error.dot(standardised), inverse, n};
  }
  // (I - H)^-1 e has the covariance (I - H)^-1.
  const RowMatrix inverse = one - explained;
  const Vector e = residual_.segment(which.first, n);
  const RowMatrix half = cholesky_factor(inverse);
  if (half.size() > 0 && half.diagonal().cwiseAbs2().minCoeff() > kPoorPivot) {
    return {e, lower_solution(half, e).squaredNorm(), inverse, n};
  }
  const RowMatrix covariance = symmetric_inverse(inverse).matrix;
  const auto [seen, rank] = symmetric_inverse(covariance);
  const Vector error = covariance * e;
  const Vector standardised = seen * error;
  return {standardised, error.dot(standardised), seen, rank};
}

std::optional<double> Projection::legs_together(Index first, Index second) const {
  const LegBlock& a = legs_[static_cast<std::size_t>(first)];
  const LegBlock& b = legs_[static_cast<std::size_t>(second)];
  std::vector<Index> of_a, of_b;  // rows of the blocks
  for (std::size_t i = 0, j = 0; i < a.poses.size(); ++i) {
    while (j < b.poses.size() && b.poses[j] < a.poses[i]) {
      ++j;
    }
    for (Index c = 0;
         j < b.poses.size() && b.poses[j] == a.poses[i] && counts(a.poses[i]) && c < closures_;
         ++c) {
      of_a.push_back(static_cast<Index>(i) * closures_ + c);
      of_b.push_back(static_cast<Index>(j) * closures_ + c);
    }
  }
  const auto pairs = static_cast<Index>(of_a.size());
  if (pairs < 2) {
    return std::nullopt;
  }
  double value = 0;
  for (Index k = 0; k < pairs; ++k) {
    const auto at = static_cast<std::size_t>(k);
    value += residual_[a.rows[static_cast<std::size_t>(of_a[at])]] *
             residual_[b.rows[static_cast<std::size_t>(of_b[at])]];
  }
  // No row is in two pairs: with G = Q_a' Q_b, which needs no more than the legs' own columns,
  //   tr(MR) = -tr G,  tr((MR)^2) = pairs/2 - (|Q_a|^2 + |Q_b|^2)/2 + (|G|^2 + sum(G o G'))/2.
  const RowMatrix q_a = a.basis(of_a, kAll);
  const RowMatrix q_b = b.basis(of_b, kAll);
  const RowMatrix g = product(q_a.transpose(), q_b);
  const Index common = std::min(g.rows(), g.cols());
  const RowMatrix square = g.bottomRightCorner(common, common);
  return standardised(pairs, value, -square.trace(),
                      (static_cast<double>(pairs) - q_a.squaredNorm() - q_b.squaredNorm() +
                       g.squaredNorm() + square.cwiseProduct(square.transpose()).sum()) /
                          2);
}

std::optional<double> Projection::neighbours() const {
  Index pairs = 0;
  double value = 0;
  double moved_square = 0;                            // |MQ|^2
  RowMatrix inner = RowMatrix::Zero(rank(), rank());  // Q'MQ
  for (const LegBlock& leg : legs_) {
    std::vector<Index> rows;  // of the poses that count, in the order of measuring
    for (std::size_t i = 0; i < leg.rows.size(); ++i) {
      if (counts(leg.poses[i / static_cast<std::size_t>(closures_)])) {
        rows.push_back(static_cast<Index>(i));
      }
    }
    const auto n = static_cast<Index>(rows.size()) - closures_;  // pairs
    if (n <= 0) {
      continue;
    }
    const RowMatrix q = leg.basis(rows, kAll);
    RowMatrix moved = RowMatrix::Zero(q.rows(), q.cols());
    moved.topRows(n) += q.bottomRows(n) / 2;
    moved.bottomRows(n) += q.topRows(n) / 2;
    for (Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const auto next = static_cast<std::size_t>(i + closures_);
      value += residual_[leg.rows[static_cast<std::size_t>(rows[at])]] *
               residual_[leg.rows[static_cast<std::size_t>(rows[next])]];
    }
    pairs += n;
    moved_square += moved.squaredNorm();
    inner.bottomRightCorner(q.cols(), q.cols()) += product(q.transpose(), moved);
  }
  return standardised(pairs, value, -inner.trace(),
                      static_cast<double>(pairs) / 2 - 2 * moved_square + inner.squaredNorm());
}

std::optional<double> Projection::standardised(Index pairs, double value, double trace,
                                               double square) const {
  if (pairs < 2) {
    return std::nullopt;
  }
  const auto n = static_cast<double>(degrees_of_freedom_);
  const double variance = 2 * (n * square - trace * trace) / (n * n * (n + 2));
  return (value / chi_square() - trace / n) / std::sqrt(variance);
}

}  // namespace symkin
