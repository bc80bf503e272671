// SPDX-License-Identifier: MIT
#include "symkin/design/kernels.hpp"

#include "symkin/design/kernels_body.hpp"

namespace symkin {
namespace {

// One set of kernels for an instruction set: the bodies are inlined into functions that the
// compiler may translate with it, so that one binary runs, and runs fast, everywhere.
#define SYMKIN_KERNELS(variant, target)                                                   \
  namespace variant {                                                                     \
  target void transform(const double* x, const double* t, Shape shape, double* z) {       \
    body::transform(x, t, shape, z);                                                      \
  }                                                                                       \
  target void variance(const double* x, const double* t, Shape shape, double* trace,      \
                       double* group_max) {                                               \
    body::variance(x, t, shape, trace, group_max);                                        \
  }                                                                                       \
  target void gram(const double* x, const double* t, Shape shape, double* gram_columns,   \
                   double* trace, double* group_max) {                                    \
    body::gram(x, t, shape, gram_columns, trace, group_max);                              \
  }                                                                                       \
  target void gram_update(const double* x, const double* u, double scale, Shape shape,    \
                          double* gram_columns, double* trace, double* group_max) {       \
    body::gram_update(x, u, scale, shape, gram_columns, trace, group_max);                \
  }                                                                                       \
  target void outer_sum(const double* x, Shape shape, double* sum) {                      \
    body::outer_sum(x, shape, sum);                                                       \
  }                                                                                       \
  target void best_pair(const double* x, const double* gram_columns, const double* trace, \
                        const double* group_max, const Leaving& leaving, Shape shape,     \
                        BestPair& best) {                                                 \
    body::best_pair(x, gram_columns, trace, group_max, leaving, shape, best);             \
  }                                                                                       \
  constexpr Kernels kTable{                                                               \
      transform, variance, gram, gram_update, outer_sum, best_pair, #variant};            \
  }

SYMKIN_KERNELS(baseline, )

#if defined(__x86_64__)
SYMKIN_KERNELS(avx2, __attribute__((target("avx2,fma"))))
SYMKIN_KERNELS(avx512, __attribute__((target("avx512f"))))

const Kernels& widest() {
  if (__builtin_cpu_supports("avx512f")) {
    return avx512::kTable;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return avx2::kTable;
  }
  return baseline::kTable;
}
#else
const Kernels& widest() { return baseline::kTable; }
#endif

}  // namespace

const Kernels& kernels() {
  static const Kernels& chosen = widest();
  return chosen;
}

}  // namespace symkin
