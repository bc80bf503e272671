// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// [R]US: a crank about an axis in space, through A along a, and a rod from the crank's end to the
// platform (rotary delta, Hexa). q is the crank's angle about a, from p0. Closure (m): distance
// from the crank's end to the platform point, less the rod:  |w - l (cos q p0 + sin q n)| - L.
// Working mode: sign of a . (crank x rod).
struct RusActive1 {
  using ForTranslating = LegGeometry<kProximalLength, kDistalLength, kBaseRadius, kBaseAzimuth,
                                     kBaseHeight, kAxisAzimuth, kAxisElevation, kAxisSwing>;
  using ForRigid = LegGeometry<kProximalLength, kDistalLength, kBaseRadius, kBaseAzimuth,
                               kBaseHeight, kAxisAzimuth, kAxisElevation, kAxisSwing,
                               kPlatformRadius, kPlatformAzimuth, kPlatformHeight>;
  static constexpr std::string_view kName = "[R]US";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_about_axis;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode =
      "sign of (axis) . (crank x rod), the turn of the elbow about the crank's axis";

  template <typename Own>
  static auto base_point(const Own& own) {
    const auto& [l, L, OA, beta, height, azimuth, eps, s] = own;
    return point_at(OA, beta, height);
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& own, const Vec3<W>& w, const Q& q) {
    const auto& [l, L, OA, beta, height, azimuth, eps, s] = own;
    return norm(w - l * along(CrankFrame(azimuth, eps, s), q)) - L;
  }

  // The angle at A in the triangle of crank, rod and w, all as seen along the axis.
  template <typename Own, typename T>
  static Azimuth<T> root(const Own& own, const Vec3<T>& w, const T& mode) {
    const auto& [l, L, OA, beta, height, azimuth_of_axis, eps, s] = own;
    const Vec2<T> seen = seen_along(CrankFrame(azimuth_of_axis, eps, s), w);
    const T cosine = (dot(w, w) + l * l - L * L) / (2.0 * l * norm(seen));
    return azimuth(seen) + arc_cosine(cosine, -mode);
  }

  // To where the rod is stretched away from the crank's circle, or folded across it.
  template <typename Own, typename T>
  static T reach_margin(const Own& own, const Vec3<T>& w) {
    using std::min;
    const auto& [l, L, OA, beta, height, azimuth, eps, s] = own;
    const CrankFrame frame(azimuth, eps, s);
    const T across = norm(seen_along(frame, w));
    const T beside = dot(w, frame.axis);
    return min(L - norm(Vec2<T>{across - l, beside}), norm(Vec2<T>{across + l, beside}) - L);
  }

  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, const Azimuth<double>& q) {
    const auto& [l, L, OA, beta, height, azimuth, eps, s] = own;
    const Vec3<double> base = base_point(own);
    return centres_in_space(base, base + l * along(CrankFrame(azimuth, eps, s), q), base + w);
  }

 private:
  template <typename T, typename Q>
  static auto along(const CrankFrame<T>& frame, const Azimuth<Q>& q) {
    return q.cosine * frame.zero + q.sine * frame.across;
  }

  template <typename T>
  static Vec2<T> seen_along(const CrankFrame<T>& frame, const Vec3<T>& w) {
    return {dot(w, frame.zero), dot(w, frame.across)};
  }
};

using RusChains = SpatialChains<RusActive1>;

}  // namespace symkin
