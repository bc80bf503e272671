// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <tuple>
#include <utility>

#include "symkin/chains/planar.hpp"

namespace symkin {

namespace detail {

// The tuple of the first elements; for its type only.
template <typename Tuple, std::size_t... kIndices>
std::tuple<std::tuple_element_t<kIndices, Tuple>...> first_elements(
    std::index_sequence<kIndices...>);

template <std::size_t kSize, std::size_t... kIndices>
constexpr std::array<ParameterInfo, sizeof...(kIndices)> first_infos(
    const std::array<ParameterInfo, kSize>& all, std::index_sequence<kIndices...> /*indices*/) {
  return {all[kIndices]...};
}

}  // namespace detail

// Whether a planar leg knows the platform by its point b alone, ob and beta_b its last two
// parameters: neither the actuated joint nor a guide stands on the platform.
template <typename Leg>
constexpr bool can_carry_a_point() {
  constexpr auto& kInfos = Leg::kParameterInfos;
  constexpr std::size_t kFirst = kInfos.size() - 2;
  for (std::size_t i = 0; i < kFirst; ++i) {
    if (kInfos[i].role.end == End::platform) {
      return false;
    }
  }
  return Leg::template Pose<double>::kSpace == PoseSpace::planar &&
         turned_end(Leg::kActiveJoint) != End::platform &&
         kInfos[kFirst].role == ParameterRole{End::platform, ParameterKind::radius} &&
         kInfos[kFirst + 1].role == ParameterRole{End::platform, ParameterKind::azimuth};
}

// A planar leg that carries a point (five-bar and its kin): the same closure with ob = 0 and
// phi = 0, without ob and beta_b.
template <typename Leg>
struct PointPlatform {
  static_assert(can_carry_a_point<Leg>());
  static constexpr int kGeometry = Leg::kGeometry - 2;
  static constexpr int kClosures = Leg::kClosures;
  static constexpr auto kParameterInfos =
      detail::first_infos(Leg::kParameterInfos, std::make_index_sequence<kGeometry>());
  static constexpr std::string_view kName = Leg::kName;
  static constexpr ActiveJoint kActiveJoint = Leg::kActiveJoint;
  static constexpr bool kModeIsOrientation = Leg::kModeIsOrientation;
  static constexpr std::string_view kWorkingMode = Leg::kWorkingMode;
  template <typename T>
  using Pose = PointPose<T>;
  template <typename T>
  using Geometry = decltype(detail::first_elements<typename Leg::template Geometry<T>>(
      std::make_index_sequence<kGeometry>()));

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    return Leg::template closure<G>(with_platform<G>(geometry), unturned(pose), q);
  }

  template <typename T>
  static auto root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    return Leg::root(with_platform<T>(geometry), unturned(pose), mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return Leg::reach_margin(with_platform<T>(geometry), unturned(pose));
  }

  template <typename Q>
  static auto joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                            const Q& q) {
    return Leg::joint_centres(with_platform<double>(geometry), unturned(pose), q);
  }

 private:
  template <typename T>
  static typename Leg::template Geometry<T> with_platform(const Geometry<T>& geometry) {
    return std::tuple_cat(geometry, std::make_tuple(T(0.0), Azimuth<T>::zero()));
  }

  template <typename T>
  static PlanarPose<T> unturned(const Pose<T>& pose) {
    return {pose.x, pose.y, Azimuth<T>::zero()};
  }
};

}  // namespace symkin
