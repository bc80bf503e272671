// SPDX-License-Identifier: MIT
#include "symkin/design/detail/criteria.hpp"

#include <cmath>
#include <limits>

#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

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
  const RowMatrix factor = demanded_factor(information);
  const RowMatrix inverse = product(factor.transpose(), factor);
  if (options.criterion == Criterion::O1) {
    return {inverse / (2 * static_cast<double>(information.rows())), {}};
  }
  if (options.criterion == Criterion::expected_error) {
    const double error = (inverse * options.error_weight).trace();
    return {inverse * options.error_weight * inverse / error, {}};
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

}  // namespace symkin::design::detail
