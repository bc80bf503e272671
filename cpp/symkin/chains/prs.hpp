// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/pus.hpp"
#include "symkin/chains/spatial.hpp"

namespace symkin {

// [P]RS: a slider on a guide in space, as of [P]US, and a rod from it to the platform that swings
// about an axis a (3-PRS). Closures (m): that of [P]US and the distance of the platform point from
// the plane in which the rod swings,  |w - q e| - L  and  a . (w - q e).
struct PrsActive1 {
  struct ForRigid
      : LegGeometry<kDistalLength, kBaseRadius, kBaseAzimuth, kBaseHeight, kGuideAzimuth,
                    kGuideElevation, kGuideSwing, kAxisAzimuth, kAxisElevation, kAxisSwing,
                    kPlatformRadius, kPlatformAzimuth, kPlatformHeight> {
    static constexpr int kClosures = 2;
  };
  static constexpr std::string_view kName = "[P]RS";
  static constexpr ActiveJoint kActiveJoint = PusActive1::kActiveJoint;
  static constexpr bool kModeIsOrientation = PusActive1::kModeIsOrientation;
  static constexpr std::string_view kWorkingMode = PusActive1::kWorkingMode;

  template <typename Own>
  static auto base_point(const Own& own) {
    return PusActive1::base_point(with_slider(own));
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& own, const Vec3<W>& w, const Q& q) {
    const auto& [L, OA, beta, height, of_guide, eps, s, azimuth, elevation, swing] = own;
    const auto rod = w - q * guide_direction(of_guide, eps, s);
    return closures(norm(rod) - L, dot(axis_direction(azimuth, elevation, swing), rod));
  }

  template <typename Own, typename T>
  static T root(const Own& own, const Vec3<T>& w, const T& mode) {
    return PusActive1::root(with_slider(own), w, mode);
  }

  template <typename Own, typename T>
  static T reach_margin(const Own& own, const Vec3<T>& w) {
    return PusActive1::reach_margin(with_slider(own), w);
  }

  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, double q) {
    return PusActive1::joint_centres(with_slider(own), w, q);
  }

 private:
  // The parameters of the same leg without its axis.
  template <typename Own>
  static auto with_slider(const Own& own) {
    return detail::first_references(
        own, std::make_index_sequence<PusActive1::ForTranslating::kGeometry>());
  }
};

using PrsChains = ChainList<OnRigid<PrsActive1>>;

}  // namespace symkin
