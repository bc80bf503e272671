// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/product_kernels.hpp"
#include "symkin/support/dense.hpp"

namespace symkin::design::detail {
namespace {

// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;
constexpr double kSlackOfTrace = 1e-12;  // of a determinant

// Of a matrix that only rounding makes unsymmetric: where it is nearly singular the inverse's
// largest elements differ by more than the others are.
RowMatrix symmetrised(const RowMatrix& matrix) { return (matrix + matrix.transpose()) / 2; }

}  // namespace

void compute_products(const double* columns, Shape shape, const RowMatrix& factor, double* traces,
                      double* gram) {
  std::fill_n(traces, kBlock, 0.0);
  std::fill_n(gram, gram == nullptr ? 0 : shape.gram_size() * kBlock, 0.0);
  product_kernels().add_squares(
      columns, shape, {factor.data(), factor.rows(), factor.cols(), true, nullptr}, gram, traces);
}

Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor) {
  Vector result(candidates.blocks() * kBlock);
  for (Index b = 0; b < candidates.blocks(); ++b) {
    compute_products(candidates.block(b), candidates.shape(), factor, result.data() + b * kBlock);
  }
  result.conservativeResize(candidates.count());
  return result;
}

Leaving leaving_pose(const RowMatrix& rows, RowMatrix solved) {
  const double trace = rows.cwiseProduct(solved).sum();
  if (rows.rows() == 1) {
    return {std::move(solved), {}, 1 - trace, trace};
  }
  const RowMatrix rest = symmetrised((1 + kRidge) * RowMatrix::Identity(rows.rows(), rows.rows()) -
                                     product(rows, solved.transpose()));
  return {std::move(solved), symmetrised(inverse(rest)), determinant(rest), trace};
}

Products::Products(const ColumnBlocks& candidates)
    : x_(candidates),
      gram_size_(x_.shape().rows == 1 ? 0 : x_.shape().gram_size()),
      gram_(x_.blocks() * gram_size_ * kBlock),
      trace_(x_.blocks() * kBlock),
      hidden_(RowMatrix::Constant(x_.shape().rows, x_.shape().rows, -kInfinity)),
      group_max_(static_cast<std::size_t>(x_.blocks() * kGroups)) {}

double* Products::gram(Index block) {
  return gram_size_ == 0 ? nullptr : gram_.data() + block * gram_size_ * kBlock;
}

Index Products::lane(Index candidate) const {
  return candidate / kBlock * gram_size_ * kBlock + candidate % kBlock;
}

void Products::compute(const RowMatrix& factor) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    compute_products(x_.block(b), x_.shape(), factor, trace_.data() + b * kBlock, gram(b));
  }
  product_kernels().find_largest(trace_.data(), group_max_.data(), size_of(group_max_));
}

// Block by block, so that each comes from memory once.
void Products::update(const InverseChange& change) {
  const auto& [u, scale] = change;
  for (Index b = 0; b < x_.blocks(); ++b) {
    product_kernels().add_squares(x_.block(b), x_.shape(),
                                  {u.data(), u.rows(), u.cols(), false, scale.data()}, gram(b),
                                  trace_.data() + b * kBlock);
  }
  product_kernels().find_largest(trace_.data(), group_max_.data(), size_of(group_max_));
}

void Products::set(Index candidate, const RowMatrix& products) {
  trace_[candidate] = products.trace();
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      gram_[lane(candidate) + pair * kBlock] = products(a, b);
    }
  }
  const double* first = trace_.data() + candidate / kGroup * kGroup;
  at(group_max_, candidate / kGroup) = *std::max_element(first, first + kGroup);
}

// Whatever is added to it, its trace stays below zero.
void Products::hide(Index candidate) { set(candidate, hidden_); }

RowMatrix Products::of(Index candidate) const {
  const Index r = x_.shape().rows;
  RowMatrix result = RowMatrix::Constant(r, r, trace(candidate));
  for (Index a = 0, pair = 0; pair < gram_size_; ++a) {
    for (Index b = 0; b <= a; ++b, ++pair) {
      result(a, b) = result(b, a) = gram_[lane(candidate) + pair * kBlock];
    }
  }
  return result;
}

double Products::log_ratio(Index candidate, double sign) const {
  const Index r = x_.shape().rows;
  if (r == 1) {
    return std::log1p(sign * trace(candidate));
  }
  const double ratio = determinant(RowMatrix::Identity(r, r) + sign * of(candidate));
  return std::log(std::max(ratio, std::numeric_limits<double>::min()));
}

Index Products::best_addition(const std::function<bool(Index)>& allowed) const {
  const auto r = static_cast<double>(x_.shape().rows);
  double best = -1;
  double least_trace = -1;
  Index result = -1;
  for (Index j = 0; j < x_.count(); ++j) {
    if (trace(j) > least_trace && allowed(j)) {
      const double gain = log_ratio(j, 1);
      if (gain > best) {
        best = gain;
        result = j;
        // det(I + D) <= (1 + trace D / r)^r: most need no determinant.
        least_trace = (1 - kSlackOfTrace) * r * std::expm1(best / r);
      }
    }
  }
  return result;
}

Index Products::largest() const {
  const auto group = std::max_element(group_max_.begin(), group_max_.end());
  const double* first = trace_.data() + (group - group_max_.begin()) * kGroup;
  return std::max_element(first, first + kGroup) - trace_.data();
}

// With one row the ratio is (1 + d_j)(1 - d_i) + d_ij^2, never above 1 + d_j - d_i. With more,
// A = I + Z, Z of rank q = 2 r at most and trace d_j - d_i: det A <= (1 + (d_j - d_i) / q)^q.
void Products::best_pair(const Leaving& leaving, BestPair& best) const {
  const Index r = x_.shape().rows;
  const double q = r == 1 ? 1.0 : static_cast<double>(std::min(2 * r, x_.shape().parameters));
  const auto least_excess = [&] {
    return q * ((r == 1 ? best.ratio : std::pow(best.ratio, 1 / q)) - 1);
  };
  double least = least_excess();
  alignas(64) double ratios[kGroup];
  for (Index g = 0; g < size_of(group_max_); ++g) {
    if (!(at(group_max_, g) - leaving.trace > least)) {
      continue;
    }
    const Index first = g * kGroup;
    if (product_kernels().find_ratios(
            x_.block(first / kBlock) + lane_of(first % kBlock, x_.shape().width()), x_.shape(),
            gram_.data() + lane(first), trace_.data() + first,
            {leaving.y.data(), leaving.s.data(), leaving.base}, ratios) > best.ratio) {
      const double* most = std::max_element(ratios, ratios + kGroup);
      best = {*most, first + (most - ratios)};
      least = least_excess();
    }
  }
}

}  // namespace symkin::design::detail
