// SPDX-License-Identifier: MIT
#include "symkin/design/detail/information.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kSmallestPivot = 1e-6;  // of 1 + weight d: less costs more than six digits
constexpr int kUpdatesKept = 32;
// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;

}  // namespace

void compute_traces(const double* columns, Shape shape, const RowMatrix& factor, double* traces) {
  double group_max[kGroups];
  kernels().compute({columns, shape, nullptr, traces, group_max}, factor.data());
}

Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor) {
  Vector result(candidates.count());
  alignas(64) double traces[kBlock];
  for (Index b = 0; b < candidates.blocks(); ++b) {
    compute_traces(candidates.block(b), candidates.shape(), factor, traces);
    std::copy_n(traces, std::min(kBlock, result.size() - b * kBlock), result.data() + b * kBlock);
  }
  return result;
}

Products::Products(const ColumnBlocks& candidates)
    : x_(candidates),
      gram_size_(x_.shape().rows == 1 ? 0 : x_.shape().gram_size()),
      gram_(x_.blocks() * gram_size_ * kBlock),
      trace_(x_.blocks() * kBlock),
      group_max_(x_.blocks() * kGroups) {}

BlockProducts Products::block(Index b) const {
  return {x_.block(b), x_.shape(),
          gram_size_ == 0 ? nullptr : gram_.data() + b * gram_size_ * kBlock,
          trace_.data() + b * kBlock, group_max_.data() + b * kGroups};
}

double* Products::lane(Index candidate) const {
  return block(candidate / kBlock).gram + candidate % kBlock;
}

void Products::compute(const RowMatrix& factor) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    kernels().compute(block(b), factor.data());
  }
}

void Products::update(const Vector& u, double scale) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    kernels().update(block(b), u.data(), scale);
  }
}

void Products::set(Index candidate, const RowMatrix& products) {
  trace_[candidate] = products.trace();
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      lane(candidate)[pair * kBlock] = products(a, b);
    }
  }
  const double* first = trace_.data() + candidate / kGroup * kGroup;
  group_max_[candidate / kGroup] = *std::max_element(first, first + kGroup);
}

// Whatever is added to it, its trace stays below zero.
void Products::hide(Index candidate) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  set(candidate, RowMatrix::Constant(x_.shape().rows, x_.shape().rows, -kInfinity));
}

RowMatrix Products::of(Index candidate) const {
  const Index r = x_.shape().rows;
  RowMatrix result = RowMatrix::Constant(r, r, trace_[candidate]);
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      result(a, b) = result(b, a) = lane(candidate)[pair * kBlock];
    }
  }
  return result;
}

double Products::largest_trace() const {
  return *std::max_element(group_max_.data(), group_max_.data() + x_.blocks() * kGroups);
}

void Products::best_pair(const Leaving& leaving, BestPair& best) const {
  for (Index b = 0; b < x_.blocks(); ++b) {
    BestPair found{best.ratio, -1};
    kernels().best_pair(block(b), leaving, found);
    if (found.lane >= 0) {
      best = {found.ratio, b * kBlock + found.lane};
    }
  }
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

void Information::add(const double* rows, Index count, double weight, Products* products) {
  for (Index row = 0; row < count; ++row) {
    const Eigen::Map<const Vector> x(rows + row * matrix_.rows(), matrix_.rows());
    work_.noalias() = inverse_ * x;
    const double pivot = 1 + weight * x.dot(work_);
    matrix_.noalias() += (weight * x) * x.transpose();
    if (products != nullptr) {
      products->update(work_, -weight / pivot);
    }
    if (!positive_definite_ || ++updates_ > kUpdatesKept || !(pivot > kSmallestPivot)) {
      refresh();
      continue;
    }
    inverse_.noalias() -= (weight / pivot * work_) * work_.transpose();
    log_det_ += std::log(pivot);
  }
}

Leaving leaving_pose(const RowMatrix& rows, RowMatrix solved) {
  const double trace = rows.cwiseProduct(solved).sum();
  if (rows.rows() == 1) {
    return {std::move(solved), {}, 1 - trace, trace};
  }
  const RowMatrix rest =
      (1 + kRidge) * RowMatrix::Identity(rows.rows(), rows.rows()) - rows * solved.transpose();
  return {std::move(solved), inverse(rest), determinant(rest), trace};
}

}  // namespace symkin::design::detail
