// SPDX-License-Identifier: MIT
#include "symkin/design/detail/product_kernels.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] static inline

namespace symkin::design::detail {
namespace {

#if defined(SYMKIN_COMPILES_AVX512)
constexpr Index kRegister = 64;  // bytes
#elif defined(SYMKIN_COMPILES_AVX2)
constexpr Index kRegister = 32;
#else
constexpr Index kRegister = 16;
#endif

// Candidates side by side in a register, a group of them at a time so that each coefficient is
// loaded once for all.
struct Wide {
  static constexpr Index kLanes = kRegister / 8;
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

  SYMKIN_INLINE bool all_zero(const Lanes* sums) {
    const auto zeros = [&](Index k) { return sums[k] == Lanes{}; };
    auto all = zeros(0);
    for (Index k = 1; k < kParts; ++k) {
      all &= zeros(k);
    }
    for (Index lane = 0; lane < kLanes; ++lane) {
      if (all[lane] == 0) {
        return false;
      }
    }
    return true;
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

  static void find_largest(const double* values, double* of_groups, Index groups) {
    for (Index g = 0; g < groups; ++g) {
      of_groups[g] = largest(values + g * kGroup);
    }
  }

  static void add_squares(const double* x, Shape shape, const double* u, Index size, double scale,
                          double* gram, double* trace) {
    Index first = 0;  // a leg of a whole mechanism has parameters of its own alone
    while (first < size && u[first] == 0) {
      ++first;
    }
    while (first < size && u[size - 1] == 0) {
      --size;
    }
    Lanes v[kMaxRows * kParts];
    for (Index lane = 0; lane < kBlock; lane += kGroup) {
      for (Index row = 0; row < shape.rows; ++row) {
        Lanes* of_row = v + row * kParts;
        combine<kParts>(x + (row * shape.parameters + first) * kBlock + lane, u + first,
                        size - first, of_row);
        if (all_zero(of_row)) {  // a row of another leg
          continue;
        }
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

  static double find_ratios(const double* x, Shape shape, const double* gram, const double* trace,
                            LeavingRows leaving, double* ratios) {
    const Index r = shape.rows;
    const Index p = shape.parameters;
    const double* y = leaving.y;
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
        bordered_determinant(gram + kLanes * k, cross, leaving.s, r, &ratio);
        ratio *= leaving.base;
      }
      store(ratios)[k] = d >= 0.0 ? ratio : Lanes{};
    }
    return largest(ratios);
  }
};

constexpr ProductKernels kWide{Wide::find_largest, Wide::add_squares, Wide::find_ratios};

}  // namespace

#if defined(SYMKIN_COMPILES_AVX512)
ProductKernels product_kernels_avx512() { return kWide; }
#elif defined(SYMKIN_COMPILES_AVX2)
ProductKernels product_kernels_avx2() { return kWide; }
#else
#ifdef SYMKIN_HAS_AVX2
ProductKernels product_kernels_avx2();
#endif
#ifdef SYMKIN_HAS_AVX512
ProductKernels product_kernels_avx512();
#endif

const ProductKernels& product_kernels() {
  static const ProductKernels kernels = [] {
#ifdef SYMKIN_HAS_AVX512
    if (processor() >= Processor::avx512) {
      return product_kernels_avx512();
    }
#endif
#ifdef SYMKIN_HAS_AVX2
    if (processor() >= Processor::avx2) {
      return product_kernels_avx2();
    }
#endif
    return kWide;
  }();
  return kernels;
}
#endif

}  // namespace symkin::design::detail
