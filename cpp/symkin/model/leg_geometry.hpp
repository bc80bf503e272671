// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <tuple>
#include <type_traits>

#include "symkin/model/azimuth.hpp"
#include "symkin/model/roles.hpp"

namespace symkin {

// The parameters of a leg's geometry, in the order of its arrays, as a leg struct inherits them:
// names, roles, and the tuple in which a closure takes them, angles with their cosine and sine.
template <const ParameterInfo&... kInfos>
struct LegGeometry {
  static_assert(((!turns(kInfos.role.kind) || kInfos.role.end != End::none) && ...),
                "an azimuth turns with the base or the platform");
  static constexpr int kGeometry = sizeof...(kInfos);
  static constexpr int kClosures = 1;
  static constexpr std::array<ParameterInfo, sizeof...(kInfos)> kParameterInfos{kInfos...};
  template <typename T>
  using Geometry = std::tuple<std::conditional_t<is_angle(kInfos.role.kind), Azimuth<T>, T>...>;
};

// The leg structs of a family, for the registry.
template <typename... Legs>
struct ChainList {};

}  // namespace symkin
