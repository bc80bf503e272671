// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// R[P]S: a leg that swings about an axis through A and is as long as it is driven (3-RPS). Closures
// (m): distance between base and platform point, less the leg's length, and distance of the
// platform point from the plane in which the leg swings,  |w| - q  and  a . w.  The length is the
// only root.
struct RpsActive2 {
  struct ForRigid
      : LegGeometry<kBaseRadius, kBaseAzimuth, kBaseHeight, kAxisAzimuth, kAxisElevation,
                    kAxisSwing, kPlatformRadius, kPlatformAzimuth, kPlatformHeight> {
    static constexpr int kClosures = 2;
  };
  static constexpr std::string_view kName = "R[P]S";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the length is the only root";

  template <typename Own>
  static auto base_point(const Own& own) {
    const auto& [OA, beta, height, azimuth, eps, s] = own;
    return point_at(OA, beta, height);
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& own, const Vec3<W>& w, const Q& q) {
    const auto& [OA, beta, height, azimuth, eps, s] = own;
    return closures(norm(w) - q, dot(axis_direction(azimuth, eps, s), w));
  }

  template <typename Own, typename T>
  static T root(const Own& /*own*/, const Vec3<T>& w, const T& /*mode*/) {
    return norm(w);
  }

  template <typename Own, typename T>
  static T reach_margin(const Own& /*own*/, const Vec3<T>& /*w*/) {
    return T(kUnlimitedReach);
  }

  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, double /*q*/) {
    const Vec3<double> base = base_point(own);
    return centres_in_space(base, base + w);
  }
};

using RpsChains = ChainList<OnRigid<RpsActive2>>;

}  // namespace symkin
