// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/design/detail/information.hpp"
#include "symkin/support/dense.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] static inline

// A function whose body is `call` of Wide<lanes>, for each kind of processor where the loader can
// choose among them.
#if defined(__x86_64__) && defined(__GLIBC__)
#define SYMKIN_WIDE(function, call)                              \
  [[gnu::target("default")]] function { return Wide<2>::call; }  \
  [[gnu::target("avx2,fma")]] function { return Wide<4>::call; } \
  [[gnu::target("avx512f")]] function { return Wide<8>::call; }
#else
#define SYMKIN_WIDE(function, call) \
  function { return Wide<2>::call; }
#endif

namespace symkin::design::detail {
namespace {

// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;
constexpr double kSlackOfTrace = 1e-12;  // of a determinant

// Candidates side by side in a register, a group of them at a time so that each coefficient is
// loaded once for all.
template <Index kLanes>
struct Wide {
  using Lanes [[gnu::vector_size(8 * kLanes), gnu::aligned(8), gnu::may_alias]] = double;
  static constexpr Index kParts = kGroup / kLanes;

  SYMKIN_INLINE const Lanes* load(const double* values) {
    return reinterpret_cast<const Lanes*>(values);
  }
  SYMKIN_INLINE Lanes* store(double* values) { return reinterpret_cast<Lanes*>(values); }

  // sum[k] = sum over `size` columns of coefficient[c] * column c.
  template <Index kCount>
  SYMKIN_INLINE void combine(const double* x, const double* coefficients, Index size, Lanes* sum) {
    Lanes total[kCount] = {};
    for (Index c = 0; c < size; ++c) {
      for (Index k = 0; k < kCount; ++k) {
        total[k] += coefficients[c] * load(x + c * kBlock)[k];
      }
    }
    for (Index k = 0; k < kCount; ++k) {
      sum[k] = total[k];
    }
  }

  // Of a group.
  SYMKIN_INLINE double largest(const double* values) {
    Lanes most = load(values)[0];
    for (Index k = 1; k < kParts; ++k) {
      most = load(values)[k] > most ? load(values)[k] : most;
    }
    alignas(64) double each[kLanes];
    *store(each) = most;
    for (Index half = kLanes / 2; half > 0; half /= 2) {  // each step waits for the one before
      for (Index k = 0; k < half; ++k) {
        each[k] = each[k + half] > each[k] ? each[k + half] : each[k];
      }
    }
    return each[0];
  }

  SYMKIN_INLINE void find_largest(const AlignedArray& values, std::vector<double>& of_groups) {
    for (Index g = 0; g < size_of(of_groups); ++g) {
      at(of_groups, g) = largest(values.data() + g * kGroup);
    }
  }

  SYMKIN_INLINE void add_squares(const double* x, Shape shape, const double* u, Index size,
                                 double scale, double* gram, double* trace) {
    Index first = 0;  // a leg of a whole mechanism has parameters of its own alone
    while (first < size && u[first] == 0) {
      ++first;
    }
    Lanes v[kMaxRows * kParts];
    for (Index lane = 0; lane < kBlock; lane += kGroup) {
      for (Index row = 0; row < shape.rows; ++row) {
        Lanes* of_row = v + row * kParts;
        combine<kParts>(x + (row * shape.parameters + first) * kBlock + lane, u + first,
                        size - first, of_row);
        for (Index k = 0; k < kParts; ++k) {
          store(trace + lane)[k] += scale * (of_row[k] * of_row[k]);
        }
        for (Index other = 0; other <= row && gram != nullptr; ++other) {
          Lanes* to = store(gram + (row * (row + 1) / 2 + other) * kBlock + lane);
          for (Index k = 0; k < kParts; ++k) {
            to[k] += scale * (of_row[k] * v[other * kParts + k]);
          }
        }
      }
    }
  }

  // det(I + D_jj + E S E^T) by Cholesky pivots, D_jj at `gram`.
  SYMKIN_INLINE void bordered_determinant(const double* gram, const Lanes* e, const double* s,
                                          Index r, Lanes* determinant) {
    Lanes work[kMaxRows * kMaxRows];  // L D below the diagonal of LDL^T, and D on it
    *determinant = Lanes{} + 1.0;
    for (Index a = 0; a < r; ++a) {
      Lanes es[kMaxRows];
      for (Index c = 0; c < r; ++c) {
        Lanes sum{};
        for (Index d = 0; d < r; ++d) {
          sum += s[d * r + c] * e[a * r + d];
        }
        es[c] = sum;
      }
      for (Index b = 0; b <= a; ++b) {
        Lanes value = *load(gram + (a * (a + 1) / 2 + b) * kBlock) + (a == b ? 1.0 : 0.0);
        for (Index c = 0; c < r; ++c) {
          value += es[c] * e[b * r + c];
        }
        for (Index c = 0; c < b; ++c) {
          value -= work[a * r + c] * work[b * r + c] / work[c * r + c];
        }
        work[a * r + b] = value;
      }
      *determinant *= work[a * r + a];
    }
  }

  SYMKIN_INLINE double find_ratios(const double* x, Shape shape, const double* gram,
                                   const double* trace, const Leaving& leaving, double* ratios) {
    const Index r = shape.rows;
    const Index p = shape.parameters;
    const double* y = leaving.y.data();
    Lanes cross[kMaxRows * kMaxRows];
    if (r == 1) {
      combine<kParts>(x, y, p, cross);
    }
    for (Index k = 0; k < kParts; ++k) {
      const Lanes d = load(trace)[k];
      Lanes ratio;
      if (r == 1) {
        ratio = (1 + d) * leaving.base + cross[k] * cross[k];
      } else {
        for (Index ab = 0; ab < r * r; ++ab) {
          combine<1>(x + ab / r * p * kBlock + kLanes * k, y + ab % r * p, p, cross + ab);
        }
        bordered_determinant(gram + kLanes * k, cross, leaving.s.data(), r, &ratio);
        ratio *= leaving.base;
      }
      store(ratios)[k] = d >= 0.0 ? ratio : Lanes{};
    }
    return largest(ratios);
  }
};

}  // namespace

SYMKIN_WIDE(void find_largest(const AlignedArray& values, std::vector<double>& of_groups),
            find_largest(values, of_groups))

// D += scale (x u) (x u)^T for a block of candidates, u with `size` values and then zeros. D is
// their traces and, unless it is null, the lower triangle by rows.
SYMKIN_WIDE(void add_squares(const double* x, Shape shape, const double* u, Index size,
                             double scale, double* gram, double* trace),
            add_squares(x, shape, u, size, scale, gram, trace))

// base * det(I + D_jj + E S E^T) of a group of candidates, 0 of those hidden; returns the largest.
SYMKIN_WIDE(double find_ratios(const double* x, Shape shape, const double* gram,
                               const double* trace, const Leaving& leaving, double* ratios),
            find_ratios(x, shape, gram, trace, leaving, ratios))

void compute_products(const double* columns, Shape shape, const RowMatrix& factor, double* traces,
                      double* gram) {
  std::fill_n(traces, kBlock, 0.0);
  std::fill_n(gram, gram == nullptr ? 0 : shape.gram_size() * kBlock, 0.0);
  for (Index a = 0; a < factor.rows(); ++a) {
    add_squares(columns, shape, factor.row(a).data(), a + 1, 1, gram, traces);
  }
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
  const RowMatrix rest = (1 + kRidge) * RowMatrix::Identity(rows.rows(), rows.rows()) -
                         product(rows, solved.transpose());
  return {std::move(solved), inverse(rest), determinant(rest), trace};
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
  find_largest(trace_, group_max_);
}

void Products::update(const Vector& u, double scale) {
  for (Index b = 0; b < x_.blocks(); ++b) {
    add_squares(x_.block(b), x_.shape(), u.data(), u.size(), scale, gram(b),
                trace_.data() + b * kBlock);
  }
  find_largest(trace_, group_max_);
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
    if (find_ratios(x_.block(first / kBlock) + first % kBlock, x_.shape(),
                    gram_.data() + lane(first), trace_.data() + first, leaving,
                    ratios) > best.ratio) {
      const double* most = std::max_element(ratios, ratios + kGroup);
      best = {*most, first + (most - ratios)};
      least = least_excess();
    }
  }
}

}  // namespace symkin::design::detail
