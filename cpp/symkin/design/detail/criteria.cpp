// SPDX-License-Identifier: MIT
#include "symkin/design/detail/criteria.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kLeastRatio = 1e-4;  // of determinants: less costs more digits than four
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Vector scale_or_ones(const SelectionOptions& options, Index p) {
  return options.column_scale.size() == 0 ? Vector::Ones(p) : options.column_scale;
}

// The information matrix with its columns in their unit.
RowMatrix scaled(const RowMatrix& information, const Vector& scale) {
  return scale.asDiagonal() * information * scale.asDiagonal();
}

}  // namespace

double criterion_value(const RowMatrix& information, const SelectionOptions& options) {
  const RowMatrix factor = inverse_factor(information);
  if (factor.size() == 0) {
    return kNaN;
  }
  const auto p = static_cast<double>(information.rows());
  if (options.criterion == Criterion::O1) {
    const Vector scale = scale_or_ones(options, information.rows());
    return std::exp(log_determinant(factor) / (2 * p) + scale.array().log().mean()) / p;
  }
  if (options.criterion == Criterion::expected_error) {
    return (factor * options.error_weight).cwiseProduct(factor).sum();
  }
  const Vector eigenvalues =
      symmetric_eigenvalues(scaled(information, scale_or_ones(options, information.rows())));
  if (!(eigenvalues[0] > 0)) {
    return kNaN;
  }
  const double smallest = std::sqrt(eigenvalues[0]);
  const double largest = std::sqrt(eigenvalues[eigenvalues.size() - 1]);
  switch (options.criterion) {
    case Criterion::O2:
      return smallest / largest;
    case Criterion::O3:
      return smallest;
    case Criterion::O4:
      return smallest * smallest / largest;
    default:
      return 1 / eigenvalues.array().sqrt().inverse().sum();
  }
}

double criterion_merit(const RowMatrix& information, const SelectionOptions& options) {
  const double value = criterion_value(information, options);
  if (std::isnan(value)) {
    return -kInfinity;
  }
  return options.criterion == Criterion::expected_error ? -std::log(value) : std::log(value);
}

CriterionGradient criterion_gradient(const RowMatrix& information, const SelectionOptions& options,
                                     double sharpness) {
  if (options.criterion == Criterion::expected_error) {
    return {error_slopes(information, options.error_weight).gradient(), {}};
  }
  const RowMatrix factor = demanded_factor(information);
  if (options.criterion == Criterion::O1) {
    const RowMatrix inverse = product(factor.transpose(), factor);
    return {inverse / (2 * static_cast<double>(information.rows())), {}};
  }
  const Vector scale = scale_or_ones(options, information.rows());
  const SymmetricEigen eigen = symmetric_eigen(scaled(information, scale));
  const Vector& values = eigen.values;
  Vector weights = (values[0] / values.array()).pow(sharpness);
  if (options.criterion == Criterion::O5) {
    weights = values.array().sqrt().inverse();
  }
  weights = weights.array() / weights.sum() / (2 * values.array());
  if (options.criterion == Criterion::O4) {
    weights *= 2;
  }
  const RowMatrix vectors = scale.asDiagonal() * eigen.vectors;
  CriterionGradient result{product(vectors * weights.asDiagonal(), vectors.transpose()), {}};
  if (options.criterion == Criterion::O2 || options.criterion == Criterion::O4) {
    Vector largest = (values.array() / values[values.size() - 1]).pow(sharpness);
    largest = largest.array() / largest.sum() / (2 * values.array());
    result.loss = product(vectors * largest.asDiagonal(), vectors.transpose());
  }
  return result;
}

ErrorSlopes error_slopes(const RowMatrix& information, const RowMatrix& error_weight) {
  const RowMatrix factor = demanded_factor(information);
  const RowMatrix inverse = product(factor.transpose(), factor);
  return {inverse, product(product(inverse, error_weight), inverse),
          inverse.cwiseProduct(error_weight).sum()};
}

ErrorExchange::ErrorExchange(const Rows& in, const Rows& out) : r_(in.rows.rows()) {
  using Given = Eigen::Ref<const RowMatrix>;
  const auto fill = [&](Small& matrix, const Given& of_in, const Given& of_out) {
    matrix.resize(2 * r_, 2 * r_);
    matrix.topLeftCorner(r_, r_) = of_in.lazyProduct(in.rows.transpose());
    matrix.bottomLeftCorner(r_, r_) = of_out.lazyProduct(in.rows.transpose());
    matrix.topRightCorner(r_, r_) = matrix.bottomLeftCorner(r_, r_).transpose();
    matrix.bottomRightCorner(r_, r_) = of_out.lazyProduct(out.rows.transpose());
  };
  fill(g_, in.solved, out.solved);
  fill(h_, in.weighted, out.weighted);
}

std::optional<ErrorExchange::Small> ErrorExchange::inverse_at(double share) const {
  Small k = share * g_;
  k.diagonal().head(r_).array() += 1;
  k.diagonal().tail(r_).array() -= 1;
  const Eigen::PartialPivLU<Small> lu(k);
  if (!(lu.determinant() * (r_ % 2 == 0 ? 1 : -1) > kLeastRatio)) {
    return std::nullopt;
  }
  return lu.inverse();
}

std::optional<double> ErrorExchange::gain(double share) const {
  const std::optional<Small> k = inverse_at(share);
  // Both are symmetric: the trace of their product.
  return k ? std::optional(share * k->cwiseProduct(h_).sum()) : std::nullopt;
}

}  // namespace symkin::design::detail
