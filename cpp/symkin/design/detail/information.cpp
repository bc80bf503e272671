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
constexpr double kHidden = -std::numeric_limits<double>::infinity();
// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;
constexpr int kNewtonSteps = 20;

}  // namespace

Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor) {
  Vector result(candidates.count());
  alignas(64) double trace[kBlock];
  double unused[kGroups];
  for (Index b = 0; b < candidates.blocks(); ++b) {
    kernels().products(candidates.block(b), factor.data(), candidates.shape(), nullptr, trace,
                       unused);
    std::copy_n(trace, std::min(kBlock, result.size() - b * kBlock), result.data() + b * kBlock);
  }
  return result;
}

Products::Products(const ColumnBlocks& candidates)
    : x_(candidates),
      gram_size_(x_.shape().rows == 1 ? 0 : x_.shape().gram_size()),
      gram_(x_.blocks() * gram_size_ * kBlock),
      trace_(x_.blocks() * kBlock),
      group_max_(x_.blocks() * kGroups) {}

void Products::compute(const RowMatrix& factor) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    kernels().products(x_.block(b), factor.data(), x_.shape(), gram(b), trace_.data() + b * kBlock,
                       group_max_.data() + b * kGroups);
  }
}

void Products::update(const Vector& u, double scale) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    kernels().update(x_.block(b), u.data(), scale, x_.shape(), gram(b), trace_.data() + b * kBlock,
                     group_max_.data() + b * kGroups);
  }
}

void Products::set(Index candidate, const RowMatrix& products) {
  trace_[candidate] = products.trace();
  double* lane = gram(candidate / kBlock) + candidate % kBlock;
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      lane[pair * kBlock] = products(a, b);
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
  const double* lane = gram(candidate / kBlock) + candidate % kBlock;
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      result(a, b) = result(b, a) = lane[pair * kBlock];
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
    kernels().best_pair(x_.block(b), gram(b), trace_.data() + b * kBlock,
                        group_max_.data() + b * kGroups, leaving, x_.shape(), found);
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

PairStep::PairStep(Shape shape)
    : shape_(shape),
      pair_(2 * shape.rows, shape.parameters),
      solved_(2 * shape.rows, shape.parameters),
      gram_(2 * shape.rows, 2 * shape.rows) {}

double PairStep::operator()(const Information& information, const double* giver,
                            const double* taker, double limit) {
  const Index r = shape_.rows;
  pair_.topRows(r) = Eigen::Map<const RowMatrix>(taker, r, shape_.parameters);
  pair_.bottomRows(r) = Eigen::Map<const RowMatrix>(giver, r, shape_.parameters);
  solved_.noalias() = pair_.lazyProduct(information.inverse());
  gram_.noalias() = solved_.lazyProduct(pair_.transpose());
  const double gain = gram_.diagonal().head(r).sum() - gram_.diagonal().tail(r).sum();
  if (!(gain > 0)) {
    return 0;
  }
  if (r > 1) {
    return newton(limit);
  }
  // a = (d_l - d_k) / (2 (d_l d_k - d_kl^2)).
  const double curvature = 2 * (gram_(0, 0) * gram_(1, 1) - gram_(0, 1) * gram_(1, 0));
  return gain < limit * curvature ? gain / curvature : limit;
}

// With G the 2r x 2r matrix of products and E = diag(I, -I), f(a) = log det(I + a E G) is concave:
// Newton on f', kept inside the interval where f' changes sign.
double PairStep::newton(double limit) const {
  const Index size = gram_.rows();
  RowMatrix signed_gram = gram_;
  signed_gram.bottomRows(shape_.rows) *= -1;
  double low = 0;
  double high = limit;
  double step = 0;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const RowMatrix moved = RowMatrix::Identity(size, size) + step * signed_gram;
    const RowMatrix product = inverse(moved) * signed_gram;
    const double slope = product.trace();
    const double curvature = product.cwiseProduct(product.transpose()).sum();
    // Beyond a singular matrix the determinant is negative and f' means nothing.
    if (determinant(moved) <= 0 || !(curvature > 0)) {
      high = step;
      step = (low + high) / 2;
      continue;
    }
    (slope > 0 ? low : high) = step;
    double next = step + slope / curvature;
    if (next >= high) {
      next = high == limit && i == 0 ? high : (low + high) / 2;
    } else if (next <= low) {
      next = (low + high) / 2;
    }
    if (std::abs(next - step) <= 1e-6 * limit) {
      return std::min(next, high);
    }
    step = next;
  }
  return low;
}

}  // namespace symkin::design::detail
