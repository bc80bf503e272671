// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <type_traits>

#include "symkin/chains/detail/batch_lanes.hpp"
#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_kernels_of.hpp"

// The kernels of a family, compiled for several kinds of processors (cmake/SymkinKernels.cmake):
// those for AVX2 bear it in their type.
namespace symkin::chains {

template <typename... Some, typename... Others>
ChainList<Some..., Others...> operator+(ChainList<Some...>, ChainList<Others...>);

template <typename Leg>
using IfPoint =
    std::conditional_t<can_carry_a_point<Leg>(), ChainList<PointPlatform<Leg>>, ChainList<>>;

// The leg structs of a family, those that carry a point behind the others.
template <typename... Legs>
auto with_points(ChainList<Legs...>) -> decltype((ChainList<Legs...>() + ... + IfPoint<Legs>()));

// As many doubles as the processor holds, or one where xsimd does not know it.
template <typename Arch>
using Scalar = std::conditional_t<xsimd::has_simd_register<double, Arch>::value,
                                  xsimd::batch<double, Arch>, double>;

template <typename T, typename List>
struct FamilyKernels;

template <typename T, typename... Legs>
struct FamilyKernels<T, ChainList<Legs...>> {
  static constexpr std::array<LegKernels, sizeof...(Legs)> kTable{
      leg_kernels<Legs, LinearSensor, T>()...};
};

template <typename T, typename Chains>
constexpr const LegKernels* family_kernels() {
  return FamilyKernels<T, decltype(with_points(Chains()))>::kTable.data();
}

}  // namespace symkin::chains
