// SPDX-License-Identifier: MIT
#include "symkin/design/detail/criteria.hpp"

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

std::optional<double> error_gain(const ExchangedRows& in, const ExchangedRows& out) {
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 2 * kMaxRows,
                              2 * kMaxRows>;
  using Given = Eigen::Ref<const RowMatrix>;
  const Index r = in.rows.rows();
  const Index n = 2 * r;
  const auto symmetric = [&](const Given& of_in, const Given& of_out) {
    Small matrix(n, n);
    matrix.topLeftCorner(r, r) = of_in.lazyProduct(in.rows.transpose());
    matrix.bottomLeftCorner(r, r) = of_out.lazyProduct(in.rows.transpose());
    matrix.bottomRightCorner(r, r) = of_out.lazyProduct(out.rows.transpose());
    matrix.topRightCorner(r, r) = matrix.bottomLeftCorner(r, r).transpose();
    return matrix;
  };
  // Z = L^-1 H L^-T with L E L^T = D + G: trace(K H) is the sum of Z_ii / E_i. Without pivots,
  // since I + in M^-1 in^T and what is left of I - out M^-1 out^T are positive definite.
  Small l = symmetric(in.solved, out.solved);
  Small z = symmetric(in.weighted, out.weighted);
  l.diagonal().head(r).array() += 1;
  l.diagonal().tail(r).array() -= 1;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2 * kMaxRows, 1> pivots(n);
  double ratio = 1;
  for (Index i = 0; i < n; ++i) {
    double pivot = l(i, i);
    for (Index j = 0; j < i; ++j) {
      double left = l(i, j);
      for (Index k = 0; k < j; ++k) {
        left -= l(i, k) * l(j, k);  // of L E so far
      }
      l(i, j) = left;
    }
    for (Index j = 0; j < i; ++j) {
      const double scaled = l(i, j) / pivots[j];
      pivot -= l(i, j) * scaled;
      l(i, j) = scaled;
    }
    pivots[i] = pivot;
    ratio *= i < r ? pivot : -pivot;
    if (i >= r && !(pivot < 0)) {
      return std::nullopt;
    }
  }
  if (!(ratio > kLeastRatio)) {
    return std::nullopt;
  }
  double gain = 0;
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < i; ++k) {
      z.row(i) -= l(i, k) * z.row(k);
    }
  }
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j <= i; ++j) {
      for (Index k = 0; k < j; ++k) {
        z(i, j) -= z(i, k) * l(j, k);
      }
    }
    gain += z(i, i) / pivots[i];
  }
  return gain;
}

}  // namespace symkin::design::detail
