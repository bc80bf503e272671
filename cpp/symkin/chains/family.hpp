// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>

#include "symkin/chains/batch_lanes.hpp"
#include "symkin/model/leg_kernels_of.hpp"
#ifndef SYMKIN_COMPILES_AVX2
#include "symkin/chains/families.hpp"
#include "symkin/model/leg_model_of.hpp"
#endif

// How a family's source file makes its models: SYMKIN_FAMILY(family, leg structs).
//
// On x86-64 these files are compiled twice, the second time for AVX2, which the program takes where
// the processor has it. Only addresses and kernels that bear AVX2 in their type come from there:
// a function that both share could be linked from either, and fail on a processor without AVX2
// (tests/cpp/chains/shared_symbols.cmake). Fused multiplications stay off, so that results do not
// depend on the processor.
namespace symkin::chains {

// As many doubles as the processor holds, or one where xsimd does not know it.
template <typename Arch>
using Scalar = std::conditional_t<xsimd::has_simd_register<double, Arch>::value,
                                  xsimd::batch<double, Arch>, double>;

template <typename T, typename... Legs>
inline constexpr LegKernels kKernels[] = {leg_kernels<Legs, LinearSensor, T>()...};

#ifdef SYMKIN_COMPILES_AVX2
#define SYMKIN_FAMILY(family, ...) \
  const LegKernels* family##_avx2() { return kKernels<Scalar<xsimd::avx2>, __VA_ARGS__>; }
#else

// One model of each leg struct, alive until the program ends.
template <typename Leg>
const LegModel* model(const LegKernels& kernels) {
  static const LegModelOf<Leg> instance(kernels);
  return &instance;
}

template <typename... Legs>
Models models(const LegKernels* kernels) {
  Models all;
  (all.push_back(model<Legs>(*kernels++)), ...);
  return all;
}

#ifdef SYMKIN_HAS_AVX2
#define SYMKIN_KERNELS(family, ...)                          \
  (__builtin_cpu_supports("avx2") ? family##_avx2() \
                                  : kKernels<Scalar<xsimd::default_arch>, __VA_ARGS__>)
#else
#define SYMKIN_KERNELS(family, ...) kKernels<Scalar<xsimd::default_arch>, __VA_ARGS__>
#endif
#define SYMKIN_FAMILY(family, ...)   \
  const LegKernels* family##_avx2(); \
  Models family() { return models<__VA_ARGS__>(SYMKIN_KERNELS(family, __VA_ARGS__)); }
#endif

}  // namespace symkin::chains
