// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// An axis w through the centre, by its polar angle and its azimuth: where it leaves the unit
// sphere, p0 = dw/dpolar along the meridian, and tau = w x p0 across it.
template <typename T>
struct AxisFrame {
  AxisFrame(const Azimuth<T>& polar_angle, const Azimuth<T>& azimuth)
      : axis(turned(azimuth, polar_angle.sine, T(0.0), polar_angle.cosine)),
        zero(turned(azimuth, polar_angle.cosine, T(0.0), -polar_angle.sine)),
        across(turned(azimuth, T(0.0), T(1.0), T(0.0))) {}

  // The axis at that arc from w, in the direction q about it.
  template <typename Q>
  auto at(const Azimuth<T>& arc, const Azimuth<Q>& q) const {
    return arc.cosine * axis + arc.sine * (q.cosine * zero + q.sine * across);
  }

  Vec3<T> axis, zero, across;
};

// [R]RR on a sphere: three joints whose axes pass the centre, at rest w on the base, m at the
// elbow and v on the platform; the proximal link spans the arc alpha1 from w to m, the distal link
// alpha2 from m to v (Agile Eye). q is the angle of the proximal link about w, from p0. Closure
// (rad): arc from m to v, less alpha2:  atan2(|m x v|, m . v) - alpha2.  Working mode: sign of
// w . (m x v).
struct SphericalRrrActive1 : LegGeometry<kProximalArc, kDistalArc, kBasePolarAngle, kBaseAzimuth,
                                         kPlatformPolarAngle, kPlatformAzimuth> {
  static constexpr std::string_view kName = "[R]RR";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_from_meridian;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of (base axis) . (elbow axis x platform axis), the turn of the elbow";
  template <typename T>
  using Pose = SphericalPose<T>;

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [alpha1, alpha2, theta, beta, theta_b, beta_b] = geometry;
    const auto m = AxisFrame<G>(theta, beta).at(alpha1, q);
    const auto v = pose.rotation * AxisFrame<G>(theta_b, beta_b).axis;
    const Azimuth arc(dot(m, v), norm(cross(m, v)));
    return angle(arc - alpha2);
  }

  // The angle at w in the spherical triangle of the two links and the arc d from w to v.
  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [alpha1, alpha2, theta, beta, theta_b, beta_b] = geometry;
    const AxisFrame<T> base(theta, beta);
    const Vec3<T> v = pose.rotation * AxisFrame<T>(theta_b, beta_b).axis;
    const Vec2<T> seen = seen_along(base, v);
    const T cosine =
        (alpha2.cosine - alpha1.cosine * dot(base.axis, v)) / (alpha1.sine * norm(seen));
    return azimuth(seen) + arc_cosine(cosine, -mode);
  }

  // A leg's reach ends where the arc d from w to v is the sum or the difference of the links'.
  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    using std::abs;
    using std::min;
    const auto& [alpha1, alpha2, theta, beta, theta_b, beta_b] = geometry;
    const AxisFrame<T> base(theta, beta);
    const Vec3<T> v = pose.rotation * AxisFrame<T>(theta_b, beta_b).axis;
    const T d = angle(Azimuth<T>(dot(base.axis, v), norm(seen_along(base, v))));
    const T proximal = angle(alpha1);
    const T distal = angle(alpha2);
    const T sum = proximal + distal;
    return min(d - abs(proximal - distal), min(sum - d, kFullTurn - sum - d));
  }

  static auto joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                            const Azimuth<double>& q) {
    const auto& [alpha1, alpha2, theta, beta, theta_b, beta_b] = geometry;
    const AxisFrame<double> base(theta, beta);
    return centres_in_space(base.axis, base.at(alpha1, q),
                            pose.rotation * AxisFrame<double>(theta_b, beta_b).axis);
  }

 private:
  static constexpr double kFullTurn = 6.283185307179586476925;

  template <typename T>
  static Vec2<T> seen_along(const AxisFrame<T>& base, const Vec3<T>& v) {
    return {dot(v, base.zero), dot(v, base.across)};
  }
};

using SphericalChains = ChainList<SphericalRrrActive1>;

}  // namespace symkin
