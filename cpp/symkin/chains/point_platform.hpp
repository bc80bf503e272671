// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <tuple>
#include <utility>

#include "symkin/chains/planar.hpp"

namespace symkin {

namespace detail {

// The tuple of the first elements; for its type only.
template <typename Tuple, std::size_t... kIndices>
std::tuple<std::tuple_element_t<kIndices, Tuple>...> first_elements(
    std::index_sequence<kIndices...>);

}  // namespace detail

// A planar leg that carries a point (five-bar and its kin): the same closure with ob = 0 and
// phi = 0, without ob and beta_b. Only for chains that know the platform by its point b: neither
// the actuated joint nor a guide stands on the platform.
template <typename Leg>
struct PointPlatform {
  static_assert(Leg::kActiveJoint != ActiveJoint::angle_in_platform,
                "a point has no direction to measure the joint from");
  static constexpr int kGeometry = Leg::kGeometry - 2;  // ob, beta_b stand last
  static constexpr ActiveJoint kActiveJoint = Leg::kActiveJoint;
  template <typename T>
  using Pose = PointPose<T>;
  template <typename T>
  using Geometry = decltype(detail::first_elements<typename Leg::template Geometry<T>>(
      std::make_index_sequence<kGeometry>()));

  static ChainInfo info() {
    ChainInfo info = Leg::info();
    info.pose_space = PoseSpace::point;
    const auto first = info.parameters.begin() + kGeometry;
    info.parameters.erase(first, first + 2);
    return info;
  }

  template <typename T>
  static T closure(const Geometry<T>& geometry, const Pose<T>& pose, const T& q) {
    return Leg::closure(with_platform<T>(geometry), unturned(pose), q);
  }

  static double root(const Geometry<double>& geometry, const Pose<double>& pose, int mode) {
    return Leg::root(with_platform<double>(geometry), unturned(pose), mode);
  }

  static double reach_margin(const Geometry<double>& geometry, const Pose<double>& pose) {
    return Leg::reach_margin(with_platform<double>(geometry), unturned(pose));
  }

  static auto joint_centres(const Geometry<double>& geometry, const Pose<double>& pose, double q) {
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
