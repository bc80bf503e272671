// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

// Numbers side by side in a register of the processors that a kernel is compiled for
// (cmake/SymkinKernels.cmake). Nothing here is a symbol that kernels for others could share.
#define SYMKIN_INLINE [[gnu::always_inline]] static inline

namespace symkin::registers {

#if defined(SYMKIN_COMPILES_AVX512)
constexpr Index kLanes = 8;
#elif defined(SYMKIN_COMPILES_AVX2)
constexpr Index kLanes = 4;
#else
constexpr Index kLanes = 2;
#endif

using Lanes [[gnu::vector_size(8 * kLanes), gnu::aligned(8), gnu::may_alias]] = double;

SYMKIN_INLINE const Lanes* load(const double* values) {
  return reinterpret_cast<const Lanes*>(values);
}
SYMKIN_INLINE Lanes* store(double* values) { return reinterpret_cast<Lanes*>(values); }

}  // namespace symkin::registers
