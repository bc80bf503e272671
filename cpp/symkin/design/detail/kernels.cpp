// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "symkin/design/detail/blocks.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] static inline

namespace symkin::design::detail {
namespace {

// Explicit wide arithmetic in registers of kWidth doubles, a group of candidates at a time so that
// each coefficient is loaded once for all of them.
template <Index kWidth>
struct Body {
  using Lanes [[gnu::vector_size(kWidth * sizeof(double)), gnu::may_alias]] = double;
  static constexpr Index kParts = kGroup / kWidth;

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

  // sum[k] = sum over `size` columns of coefficient[c] * column c.
  SYMKIN_INLINE void combine(const double* x, const double* coefficients, Index size, Lanes* sum) {
    Lanes total[kParts] = {};
    for (Index c = 0; c < size; ++c) {
      for (Index k = 0; k < kParts; ++k) {
        total[k] += coefficients[c] * load(x + c * kBlock)[k];
      }
    }
    for (Index k = 0; k < kParts; ++k) {
      sum[k] = total[k];
    }
  }

  // gram += scale (x u) (x u)^T, and the trace, for u with `size` values and then zeros.
  SYMKIN_INLINE void add_squares(const BlockProducts& block, const double* u, Index size,
                                 double scale) {
    const auto [x, shape, gram, trace, group_max] = block;
    Index first = 0;  // a leg of a whole mechanism has parameters of its own alone
    while (first < size && u[first] == 0) {
      ++first;
    }
    Lanes v[kMaxRows * kParts];
    for (Index lane = 0; lane < kBlock; lane += kGroup) {
      for (Index row = 0; row < shape.rows; ++row) {
        combine(x + (row * shape.parameters + first) * kBlock + lane, u + first, size - first,
                v + row * kParts);
        for (Index k = 0; k < kParts; ++k) {
          store(trace + lane)[k] += scale * (v[row * kParts + k] * v[row * kParts + k]);
        }
        for (Index other = 0; other <= row && gram != nullptr; ++other) {
          Lanes* to = store(gram + (row * (row + 1) / 2 + other) * kBlock + lane);
          for (Index k = 0; k < kParts; ++k) {
            to[k] += scale * (v[row * kParts + k] * v[other * kParts + k]);
          }
        }
      }
    }
  }

  SYMKIN_INLINE void compute(const BlockProducts& block, const double* t) {
    const Shape shape = block.shape;
    std::fill_n(block.trace, kBlock, 0.0);
    std::fill_n(block.gram, block.gram == nullptr ? 0 : shape.gram_size() * kBlock, 0.0);
    for (Index a = 0; a < shape.parameters; ++a) {
      add_squares(block, t + a * shape.parameters, a + 1, 1);
    }
    find_largest(block);
  }

  SYMKIN_INLINE void update(const BlockProducts& block, const double* u, double scale) {
    add_squares(block, u, block.shape.parameters, scale);
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
  SYMKIN_INLINE void best_pair(const BlockProducts& block, const Leaving& leaving, BestPair& best) {
    const auto [x, shape, gram, trace, group_max] = block;
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
        combine(x + first, y, p, cross);
        for (Index k = 0; k < kParts; ++k) {
          const Lanes d = load(trace + first)[k];
          store(ratios)[k] = d >= 0.0 ? (1 + d) * leaving.base + cross[k] * cross[k] : Lanes{};
        }
      }
      for (Index lane = 0; r > 1 && lane < kGroup; lane += kWidth) {
        for (Index ab = 0; ab < r * r; ++ab) {
          Lanes sum{};
          for (Index c = 0; c < p; ++c) {
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
};

// One set of kernels for an instruction set: the bodies are inlined into functions that the
// compiler may translate with it, so that one binary runs, and runs fast, everywhere.
#define SYMKIN_KERNELS(variant, width, target)                                                \
  namespace variant {                                                                         \
  target void compute(const BlockProducts& block, const double* t) {                          \
    Body<width>::compute(block, t);                                                           \
  }                                                                                           \
  target void update(const BlockProducts& block, const double* u, double scale) {             \
    Body<width>::update(block, u, scale);                                                     \
  }                                                                                           \
  target void best_pair(const BlockProducts& block, const Leaving& leaving, BestPair& best) { \
    Body<width>::best_pair(block, leaving, best);                                             \
  }                                                                                           \
  constexpr Kernels kTable{compute, update, best_pair};                                       \
  }

SYMKIN_KERNELS(baseline, 2, )
#if defined(__x86_64__)
SYMKIN_KERNELS(avx2, 4, __attribute__((target("avx2,fma"))))
SYMKIN_KERNELS(avx512, 8, __attribute__((target("avx512f"))))
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
