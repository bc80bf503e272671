// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// [P]US: a slider on a guide in space, through A along e, and a rod from the slider to the platform
// (linear delta, hexaglide). q is the travel from A. Closure (m): distance from slider to platform
// point, less the rod:  |w - q e| - L.  Working mode: sign of e . (rod from slider to platform); -1
// is the slider ahead of the platform point. To move A along its guide is to change the sensor's
// offset: held_parameters() says which of them is not estimated.
struct PusActive1 {
  using ForTranslating = LegGeometry<kDistalLength, kBaseRadius, kBaseAzimuth, kBaseHeight,
                                     kGuideAzimuth, kGuideElevation, kGuideSwing>;
  using ForRigid =
      LegGeometry<kDistalLength, kBaseRadius, kBaseAzimuth, kBaseHeight, kGuideAzimuth,
                  kGuideElevation, kGuideSwing, kPlatformRadius, kPlatformAzimuth, kPlatformHeight>;
  static constexpr std::string_view kName = "[P]US";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_from_point;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode =
      "sign of (guide) . (rod from slider to platform); -1 is the slider ahead of its rod";

  template <typename Own>
  static auto base_point(const Own& own) {
    const auto& [L, OA, beta, height, azimuth, eps, s] = own;
    return point_at(OA, beta, height);
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& own, const Vec3<W>& w, const Q& q) {
    const auto& [L, OA, beta, height, azimuth, eps, s] = own;
    return norm(w - q * guide_direction(azimuth, eps, s)) - L;
  }

  template <typename Own, typename T>
  static T root(const Own& own, const Vec3<T>& w, const T& mode) {
    const auto& [L, OA, beta, height, azimuth, eps, s] = own;
    const Vec3<T> e = guide_direction(azimuth, eps, s);
    return dot(e, w) - mode * triangle_leg(L, beside(w, e));
  }

  template <typename Own, typename T>
  static T reach_margin(const Own& own, const Vec3<T>& w) {
    const auto& [L, OA, beta, height, azimuth, eps, s] = own;
    return L - beside(w, guide_direction(azimuth, eps, s));
  }

  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, double q) {
    const auto& [L, OA, beta, height, azimuth, eps, s] = own;
    const Vec3<double> base = base_point(own);
    return centres_in_space(base, base + q * guide_direction(azimuth, eps, s), base + w);
  }

 private:
  // Distance of the platform point from the guide.
  template <typename T>
  static T beside(const Vec3<T>& w, const Vec3<T>& e) {
    return norm(w - dot(e, w) * e);
  }
};

using PusChains = SpatialChains<PusActive1>;

}  // namespace symkin
