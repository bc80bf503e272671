// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "symkin/design/detail/blocks.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] static inline

namespace symkin::design::detail {
namespace {

// Explicit wide arithmetic, a group of candidates at a time, so that each coefficient is loaded once
// for all of them. Plain loops over the group's numbers make a whole selection 1.15 times as slow;
// Eigen's products, REPLACE. The compiler splits what is wider than its registers.
using Lanes [[gnu::vector_size(64), gnu::may_alias]] = double;
constexpr Index kWidth = 8;
constexpr Index kParts = kGroup / kWidth;

SYMKIN_INLINE const Lanes* load(const double* address) {
  return reinterpret_cast<const Lanes*>(address);
}
SYMKIN_INLINE Lanes* store(double* address) { return reinterpret_cast<Lanes*>(address); }

// Of one group.
SYMKIN_INLINE double largest(const double* values) {
  alignas(64) Lanes most = load(values)[0];
  for (Index k = 1; k < kParts; ++k) {
    most = load(values)[k] > most ? load(values)[k] : most;
  }
  const auto* each = reinterpret_cast<const double*>(&most);
  return *std::max_element(each, each + kWidth);
}

SYMKIN_INLINE void find_largest(const BlockProducts& block) {
  for (Index g = 0; g < kGroups; ++g) {
    block.group_max[g] = largest(block.trace + g * kGroup);
  }
}

// sum[k] = sum over the span's columns of coefficient[c] * column c.
SYMKIN_INLINE void combine(const double* x, const double* coefficients, Span span, Lanes* sum) {
  Lanes total[kParts] = {};
  for (Index c = span.first; c < span.end; ++c) {
    for (Index k = 0; k < kParts; ++k) {
      total[k] += coefficients[c] * load(x + c * kBlock)[k];
    }
  }
  for (Index k = 0; k < kParts; ++k) {
    sum[k] = total[k];
  }
}

// gram += scale (x u) (x u)^T, and the trace; of u the columns of `known` are not zero.
SYMKIN_INLINE void add_squares(const BlockProducts& block, const double* u, Span known,
                               double scale) {
  const auto [x, shape, spans, gram, trace, group_max] = block;
  known = without_zeros(known, [&](Index c) { return u[c] == 0; });
  Lanes v[kMaxRows * kParts];
  Index known_rows[kMaxRows];
  for (Index lane = 0; lane < kBlock; lane += kGroup) {
    Index count = 0;
    for (Index row = 0; row < shape.rows; ++row) {
      const Span span = common(spans[row], known);
      if (span.empty()) {
        continue;
      }
      combine(x + row * shape.parameters * kBlock + lane, u, span, v + row * kParts);
      for (Index k = 0; k < kParts; ++k) {
        store(trace + lane)[k] += scale * (v[row * kParts + k] * v[row * kParts + k]);
      }
      known_rows[count++] = row;
      for (Index i = 0; i < count && gram != nullptr; ++i) {
        const Index other = known_rows[i];
        Lanes* to = store(gram + (row * (row + 1) / 2 + other) * kBlock + lane);
        for (Index k = 0; k < kParts; ++k) {
          to[k] += scale * (v[row * kParts + k] * v[other * kParts + k]);
        }
      }
    }
  }
}

SYMKIN_INLINE void compute_products(const BlockProducts& block, const double* t) {
  const Shape shape = block.shape;
  std::fill_n(block.trace, kBlock, 0.0);
  std::fill_n(block.gram, block.gram == nullptr ? 0 : shape.gram_size() * kBlock, 0.0);
  for (Index a = 0; a < shape.parameters; ++a) {
    add_squares(block, t + a * shape.parameters, {0, a + 1}, 1);
  }
  find_largest(block);
}

SYMKIN_INLINE void update_products(const BlockProducts& block, const double* u, double scale) {
  add_squares(block, u, {0, block.shape.parameters}, scale);
  find_largest(block);
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

// With one row the ratio is (1 + d_j)(1 - d_i) + d_ij^2, never above 1 + d_j - d_i. With more,
// A = I + Z, Z of rank q = 2 r at most and trace d_j - d_i: det A <= (1 + (d_j - d_i) / q)^q.
SYMKIN_INLINE void find_best_pair(const BlockProducts& block, const Leaving& leaving,
                                  BestPair& best) {
  const auto [x, shape, spans, gram, trace, group_max] = block;
  const Index r = shape.rows;
  const Index p = shape.parameters;
  const double* y = leaving.y.data();
  const double q = r == 1 ? 1.0 : static_cast<double>(std::min(2 * r, p));
  alignas(64) double ratios[kGroup];
  Lanes cross[kMaxRows * kMaxRows];
  for (Index first = 0; first < kBlock; first += kGroup) {
    const double excess = group_max[first / kGroup] - leaving.trace;
    const double power = r == 1 ? best.ratio : std::pow(best.ratio, 1 / q);
    if (!(excess > q * (power - 1))) {
      continue;
    }
    if (r == 1) {
      combine(x + first, y, {0, p}, cross);
      for (Index k = 0; k < kParts; ++k) {
        const Lanes d = load(trace + first)[k];
        store(ratios)[k] = d >= 0.0 ? (1 + d) * leaving.base + cross[k] * cross[k] : Lanes{};
      }
    }
    for (Index lane = 0; r > 1 && lane < kGroup; lane += kWidth) {
      for (Index ab = 0; ab < r * r; ++ab) {
        Lanes sum{};
        for (Index c = spans[ab / r].first; c < spans[ab / r].end; ++c) {
          sum += y[ab % r * p + c] * *load(x + (ab / r * p + c) * kBlock + first + lane);
        }
        cross[ab] = sum;
      }
      Lanes determinant;
      bordered_determinant(gram + first + lane, cross, leaving.s.data(), r, &determinant);
      *store(ratios + lane) =
          *load(trace + first + lane) >= 0.0 ? leaving.base * determinant : Lanes{};
    }
    if (largest(ratios) > best.ratio) {
      const double* most = std::max_element(ratios, ratios + kGroup);
      best = {*most, first + (most - ratios)};
    }
  }
}

// One set of kernels for an instruction set: the bodies are inlined into functions that the
// compiler may translate with it, so that one binary runs, and runs fast, everywhere.
#define SYMKIN_KERNELS(variant, target)                                                       \
  namespace variant {                                                                         \
  target void compute(const BlockProducts& block, const double* t) {                          \
    compute_products(block, t);                                                               \
  }                                                                                           \
  target void update(const BlockProducts& block, const double* u, double scale) {             \
    update_products(block, u, scale);                                                         \
  }                                                                                           \
  target void best_pair(const BlockProducts& block, const Leaving& leaving, BestPair& best) { \
    find_best_pair(block, leaving, best);                                                     \
  }                                                                                           \
  constexpr Kernels kTable{compute, update, best_pair};                                       \
  }

SYMKIN_KERNELS(baseline, )
#if defined(__x86_64__)
SYMKIN_KERNELS(avx2, __attribute__((target("avx2,fma"))))
SYMKIN_KERNELS(avx512, __attribute__((target("avx512f,prefer-vector-width=512"))))
#endif

const Kernels& widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) {
    return avx512::kTable;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return avx2::kTable;
  }
#endif
  return baseline::kTable;
}

}  // namespace

const Kernels& kernels() {
  static const Kernels& chosen = widest();
  return chosen;
}

}  // namespace symkin::design::detail
