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
constexpr double kStepTolerance = 1e-6;  // of the limit

}  // namespace

Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor) {
  Vector result(candidates.count());
  alignas(64) double trace[kBlock];
  double unused[kGroups];
  Span spans[kMaxRows];
  for (Index b = 0; b < candidates.blocks(); ++b) {
    find_spans(candidates.block(b), candidates.shape(), spans);
    kernels().compute({candidates.block(b), candidates.shape(), spans, nullptr, trace, unused},
                      factor.data());
    std::copy_n(trace, std::min(kBlock, result.size() - b * kBlock), result.data() + b * kBlock);
  }
  return result;
}

Products::Products(const ColumnBlocks& candidates)
    : x_(candidates),
      spans_(static_cast<std::size_t>(x_.blocks() * x_.shape().rows), {0, x_.shape().parameters}),
      gram_size_(x_.shape().rows == 1 ? 0 : x_.shape().gram_size()),
      gram_(x_.blocks() * gram_size_ * kBlock),
      trace_(x_.blocks() * kBlock),
      group_max_(x_.blocks() * kGroups) {}

BlockProducts Products::block(Index b) const {
  return {x_.block(b),
          x_.shape(),
          &at(spans_, b * x_.shape().rows),
          gram_size_ == 0 ? nullptr : gram_.data() + b * gram_size_ * kBlock,
          trace_.data() + b * kBlock,
          group_max_.data() + b * kGroups};
}

double* Products::lane(Index candidate) const {
  return block(candidate / kBlock).gram + candidate % kBlock;
}

void Products::compute(const RowMatrix& factor) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    find_spans(x_.block(b), x_.shape(), &at(spans_, b * x_.shape().rows));
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

// Whatever is added to it, its trace stays so.
void Products::hide(Index candidate) {
  set(candidate, RowMatrix::Constant(x_.shape().rows, x_.shape().rows, kHidden));
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

LeavingPose::LeavingPose(const RowMatrix& rows, RowMatrix solved)
    : y_(std::move(solved)), trace_(rows.cwiseProduct(y_).sum()) {
  base_ = 1 - trace_;
  if (rows.rows() > 1) {
    const RowMatrix rest =
        (1 + kRidge) * RowMatrix::Identity(rows.rows(), rows.rows()) - rows * y_.transpose();
    s_ = inverse(rest);
    base_ = determinant(rest);
  }
}

double LeavingPose::ratio(const RowMatrix& rows, const RowMatrix& products) const {
  if (rows.rows() == 1) {
    const double cross = rows.row(0).dot(y_.row(0));
    return (1 + products(0, 0)) * base_ + cross * cross;
  }
  const RowMatrix e = rows * y_.transpose();
  const RowMatrix bordered =
      RowMatrix::Identity(rows.rows(), rows.rows()) + products + e * s_ * e.transpose();
  return base_ * determinant(bordered);
}

// With G the products of both and E = diag(I, -I), log det(I + a E G) = sum log(1 + a l) over the
// eigenvalues l of E G, which are real: its slope falls while all terms are positive.
double best_step(const Information& information, const ConstRows& giver, const ConstRows& taker,
                 double limit) {
  const Index r = giver.rows();
  RowMatrix pair(2 * r, giver.cols());
  pair << taker, giver;
  const RowMatrix solved = pair.lazyProduct(information.inverse());
  const RowMatrix gram = solved.lazyProduct(pair.transpose());
  const double gain = gram.diagonal().head(r).sum() - gram.diagonal().tail(r).sum();
  if (!(gain > 0)) {
    return 0;
  }
  if (r == 1) {  // (d_l - d_k) / (2 (d_l d_k - d_kl^2))
    const double curvature = 2 * (gram(0, 0) * gram(1, 1) - gram(0, 1) * gram(1, 0));
    return gain < limit * curvature ? gain / curvature : limit;
  }
  const SymmetricEigen eigen = symmetric_eigen(gram);
  const RowMatrix root =
      eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  const RowMatrix signed_gram = root.leftCols(r) * root.leftCols(r).transpose() -
                                root.rightCols(r) * root.rightCols(r).transpose();
  const Eigen::ArrayXd values = symmetric_eigenvalues(signed_gram);
  const auto rises = [&](double step) {
    const Eigen::ArrayXd terms = 1 + step * values;
    return terms.minCoeff() > 0 && (values / terms).sum() > 0;
  };
  double low = rises(limit) ? limit : 0;
  for (double width = limit - low; width > kStepTolerance * limit;) {
    width /= 2;
    low += rises(low + width) ? width : 0;
  }
  return low;
}

}  // namespace symkin::design::detail
