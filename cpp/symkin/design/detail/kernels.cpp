// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "symkin/design/detail/blocks.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] static inline

namespace symkin::design::detail {
namespace {

// The bodies of the kernels in explicit wide arithmetic for registers of kWidth doubles, four of
// them at a time, so that each coefficient is loaded once for all.
template <Index kWidth>
struct Body {
  using Lanes [[gnu::vector_size(kWidth * sizeof(double)), gnu::may_alias]] = double;
  static constexpr Index kParts = 4;
  static constexpr Index kStep = kParts * kWidth;
  static constexpr Index kGroupParts = kGroup / kWidth;

  SYMKIN_INLINE const Lanes* load(const double* address) {
    return reinterpret_cast<const Lanes*>(address);
  }
  SYMKIN_INLINE Lanes* store(double* address) { return reinterpret_cast<Lanes*>(address); }

  // Of one group.
  SYMKIN_INLINE double largest(const double* values) {
    alignas(64) Lanes most = load(values)[0];
    for (Index k = 1; k < kGroupParts; ++k) {
      most = load(values)[k] > most ? load(values)[k] : most;
    }
    return *std::max_element(reinterpret_cast<double*>(&most),
                             reinterpret_cast<double*>(&most) + kWidth);
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

  // The coefficients that are not zero.
  SYMKIN_INLINE Span nonzero(const double* coefficients, Index size) {
    return without_zeros({0, size}, [&](Index c) { return coefficients[c] == 0; });
  }

  // Traces from the gram columns if there are any, and the largest of each group.
  SYMKIN_INLINE void summarise(const double* gram, Shape shape, double* trace, double* group_max) {
    for (Index lane = 0; gram != nullptr && lane < kBlock; lane += kWidth) {
      Lanes sum{};
      for (Index row = 0; row < shape.rows; ++row) {
        sum += *load(gram + (row * (row + 3) / 2) * kBlock + lane);
      }
      *store(trace + lane) = sum;
    }
    for (Index g = 0; g < kGroups; ++g) {
      group_max[g] = largest(trace + g * kGroup);
    }
  }

  SYMKIN_INLINE void compute(const BlockProducts& block, const double* t) {
    const auto [x, shape, spans, gram, trace, group_max] = block;
    const Index p = shape.parameters;
    const bool has_pairs = shape.rows > 1 && gram != nullptr;
    std::fill_n(gram, has_pairs ? shape.gram_size() * kBlock : 0, 0.0);
    Lanes z[kMaxRows * kParts];
    Index known_rows[kMaxRows];
    for (Index lane = 0; lane < kBlock; lane += kStep) {
      Lanes sum[kParts] = {};
      for (Index a = 0; a < p; ++a) {  // one column of z at a time
        const Span known = nonzero(t + a * p, a + 1);
        Index count = 0;
        for (Index row = 0; row < shape.rows; ++row) {
          const Span span = common(spans[row], known);
          if (span.empty()) {
            continue;
          }
          combine(x + (row * p + span.first) * kBlock + lane, t + a * p + span.first, span.size(),
                  z + row * kParts);
          for (Index k = 0; k < kParts; ++k) {
            sum[k] += z[row * kParts + k] * z[row * kParts + k];
          }
          known_rows[count++] = row;
          for (Index i = 0; i < count && has_pairs; ++i) {
            const Index other = known_rows[i];
            Lanes* to = store(gram + (row * (row + 1) / 2 + other) * kBlock + lane);
            for (Index k = 0; k < kParts; ++k) {
              to[k] += z[row * kParts + k] * z[other * kParts + k];
            }
          }
        }
      }
      for (Index k = 0; k < kParts; ++k) {
        store(trace + lane)[k] = sum[k];
      }
    }
    summarise(nullptr, shape, trace, group_max);
  }

  SYMKIN_INLINE void update(const BlockProducts& block, const double* u, double scale) {
    const auto [x, shape, spans, gram, trace, group_max] = block;
    const Index p = shape.parameters;
    const Span known = nonzero(u, p);
    double* products = shape.rows == 1 ? trace : gram;
    Lanes v[kMaxRows * kParts];
    Index known_rows[kMaxRows];
    for (Index lane = 0; lane < kBlock; lane += kStep) {
      Index count = 0;
      for (Index row = 0; row < shape.rows; ++row) {
        const Span span = common(spans[row], known);
        if (span.empty()) {
          continue;
        }
        combine(x + (row * p + span.first) * kBlock + lane, u + span.first, span.size(),
                v + row * kParts);
        known_rows[count++] = row;
        for (Index i = 0; i < count; ++i) {
          const Index other = known_rows[i];
          Lanes* to = store(products + (row * (row + 1) / 2 + other) * kBlock + lane);
          for (Index k = 0; k < kParts; ++k) {
            to[k] += scale * (v[row * kParts + k] * v[other * kParts + k]);
          }
        }
      }
    }
    summarise(shape.rows == 1 ? nullptr : gram, shape, trace, group_max);
  }

  SYMKIN_INLINE void take_best(const double* ratios, Index first, BestPair& best) {
    if (!(largest(ratios) > best.ratio)) {
      return;
    }
    for (Index lane = 0; lane < kGroup; ++lane) {
      if (ratios[lane] > best.ratio) {
        best = {ratios[lane], first + lane};
      }
    }
  }

  // det(I + D_jj + E S E^T) by Cholesky pivots, D_jj at `gram`.
  SYMKIN_INLINE void bordered_determinant(const double* gram, const Lanes* e, const double* s,
                                          Index r, Lanes* work, Lanes& determinant) {
    determinant = Lanes{} + 1.0;
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
        // LDL^T: `work` holds L D below the diagonal and D on it.
        for (Index c = 0; c < b; ++c) {
          value -= work[a * r + c] * work[b * r + c] / work[c * r + c];
        }
        work[a * r + b] = value;
      }
      determinant *= work[a * r + a];
    }
  }

  // With one row the ratio is (1 + d_j)(1 - d_i) + d_ij^2, never above 1 + d_j - d_i. With more,
  // A = I + Z, Z of rank q = 2 r at most and trace d_j - d_i: det A <= (1 + (d_j - d_i) / q)^q.
  SYMKIN_INLINE void best_pair(const BlockProducts& block, const Leaving& leaving, BestPair& best) {
    const auto [x, shape, spans, gram, trace, group_max] = block;
    const Index r = shape.rows;
    const Index p = shape.parameters;
    const double q = r == 1 ? 1.0 : static_cast<double>(std::min(2 * r, p));
    alignas(64) double ratios[kGroup];
    Lanes cross[kMaxRows * kMaxRows];
    Lanes work[kMaxRows * kMaxRows];
    for (Index first = 0; first < kBlock; first += kGroup) {
      const double excess = group_max[first / kGroup] - leaving.trace;
      const double power = r == 1 ? best.ratio : std::pow(best.ratio, 1 / q);
      if (!(excess > q * (power - 1))) {
        continue;
      }
      for (Index lane = 0; r == 1 && lane < kGroup; lane += kStep) {
        combine(x + first + lane, leaving.y, p, cross);
        for (Index k = 0; k < kParts; ++k) {
          const Lanes d = load(trace + first + lane)[k];
          store(ratios + lane)[k] =
              d >= 0.0 ? (1 + d) * leaving.base + cross[k] * cross[k] : Lanes{};
        }
      }
      for (Index lane = 0; r > 1 && lane < kGroup; lane += kWidth) {
        for (Index ab = 0; ab < r * r; ++ab) {
          Lanes sum{};
          for (Index c = spans[ab / r].first; c < spans[ab / r].end; ++c) {
            sum += leaving.y[ab % r * p + c] * *load(x + (ab / r * p + c) * kBlock + first + lane);
          }
          cross[ab] = sum;
        }
        Lanes determinant;
        bordered_determinant(gram + first + lane, cross, leaving.s, r, work, determinant);
        *store(ratios + lane) =
            *load(trace + first + lane) >= 0.0 ? leaving.base * determinant : Lanes{};
      }
      take_best(ratios, first, best);
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
