// SPDX-License-Identifier: MIT
#include "symkin/design/information.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kSmallestPivot = 1e-6;  // of 1 + weight d: less costs more than six digits
constexpr int kUpdatesKept = 32;

}  // namespace

RowMatrix inverse_factor(const RowMatrix& matrix) {
  const Index p = matrix.rows();
  RowMatrix factor = RowMatrix::Identity(p, p);
  const Eigen::LLT<RowMatrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) {
    return {};
  }
  cholesky.matrixL().solveInPlace(factor);
  if (!factor.allFinite()) {
    return {};
  }
  return factor;
}

RowMatrix demanded_factor(const RowMatrix& matrix) {
  RowMatrix factor = inverse_factor(matrix);
  if (factor.size() == 0) {
    throw InvalidInput(
        "pose selection: the information of the poses is singular to rounding; the parameters are "
        "in units too different, or the candidates hardly show one of them");
  }
  return factor;
}

double log_determinant(const RowMatrix& factor) {
  return -2 * factor.diagonal().array().log().sum();
}

void Information::reset(RowMatrix matrix) {
  matrix_ = std::move(matrix);
  work_.resize(matrix_.rows());
  refresh();
}

void Information::refresh() {
  updates_ = 0;
  const RowMatrix factor = inverse_factor(matrix_);
  positive_definite_ = factor.size() != 0;
  if (positive_definite_) {
    inverse_.noalias() = factor.transpose() * factor;
    log_det_ = log_determinant(factor);
  } else {
    inverse_.setConstant(matrix_.rows(), matrix_.cols(), std::numeric_limits<double>::quiet_NaN());
    log_det_ = -std::numeric_limits<double>::infinity();
  }
}

void Information::multiply_inverse(const double* x, double* result) const {
  const Index p = matrix_.rows();
  for (Index a = 0; a < p; ++a) {
    const double* row = inverse_.data() + a * p;
    double sum = 0;
    for (Index b = 0; b < p; ++b) {
      sum += row[b] * x[b];
    }
    result[a] = sum;
  }
}

void Information::add(const double* rows, Index count, double weight) {
  const Index p = matrix_.rows();
  for (Index row = 0; row < count; ++row) {
    const double* x = rows + row * p;
    for (Index a = 0; a < p; ++a) {
      const double scaled = weight * x[a];
      for (Index b = 0; b < p; ++b) {
        matrix_.data()[a * p + b] += scaled * x[b];
      }
    }
    if (!positive_definite_ || ++updates_ > kUpdatesKept) {
      refresh();
      continue;
    }
    double* y = work_.data();
    multiply_inverse(x, y);
    double d = 0;
    for (Index a = 0; a < p; ++a) {
      d += x[a] * y[a];
    }
    const double pivot = 1 + weight * d;
    if (!(pivot > kSmallestPivot)) {
      refresh();
      continue;
    }
    for (Index a = 0; a < p; ++a) {
      const double scaled = weight / pivot * y[a];
      for (Index b = 0; b < p; ++b) {
        inverse_.data()[a * p + b] -= scaled * y[b];
      }
    }
    log_det_ += std::log(pivot);
  }
}

}  // namespace symkin
