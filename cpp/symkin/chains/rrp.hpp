// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// A link from the base point A to a slider on a guide of the platform, the line
// u(beta_b) . p = ob of the platform frame; n' = n(phi + beta_b) is the travel's direction in the
// base frame. Whichever joint is actuated, the working mode is the sign of n' . (link), whether
// the link leans along the guide's travel or against it, and the reach ends where the base point
// is a link's length away from the guide.

// [R]RP: crank on the base, q the direction of the link in the base frame. Closure (m): distance
// of the slider from the guide:  u(phi + beta_b) . (A + l u(q) - r) - ob.  Working mode: sign of
// n' . (proximal link), hence of sin(q - phi - beta_b).
struct RrpActive1 : PlanarLeg<kProximalLength, kBaseRadius, kBaseAngle, kPlatformGuideDistance,
                              kPlatformGuideAngle> {
  // l, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "[R]RP";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(phi + beta_b) . (proximal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [l, OA, beta, ob, beta_b] = geometry;
    return beyond_platform_guide(polar(OA, beta) + polar(l, q), pose, ob, beta_b);
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [l, OA, beta, ob, beta_b] = geometry;
    const T beyond = beyond_platform_guide(polar(OA, beta), pose, ob, beta_b);
    return pose.phi + beta_b + arc_cosine(-beyond / l, mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    using std::abs;
    const auto& [l, OA, beta, ob, beta_b] = geometry;
    return l - abs(beyond_platform_guide(polar(OA, beta), pose, ob, beta_b));
  }

  // The last point is the guide's foot.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [l, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> base = polar(OA, beta);
    return centres(base, base + polar(l, q), platform_point(pose, ob, beta_b));
  }
};

// R[R]P: actuated joint at the slider, q the direction of the link, from base point to slider, in
// the platform frame. Closure (m): distance of the slider from the guide:
// u(phi + beta_b) . (A + l u(phi + q) - r) - ob.  Working mode: sign of n' . (proximal link),
// hence of sin(q - beta_b).
struct RrpActive2 : PlanarLeg<kProximalLength, kBaseRadius, kBaseAngle, kPlatformGuideDistance,
                              kPlatformGuideAngle> {
  // l, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "R[R]P";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_platform;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(phi + beta_b) . (proximal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    return RrpActive1::closure<G>(geometry, pose, pose.phi + q);
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    return RrpActive1::root(geometry, pose, mode) - pose.phi;
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return RrpActive1::reach_margin(geometry, pose);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    return RrpActive1::joint_centres(geometry, pose, pose.phi + q);
  }
};

// RR[P]: actuated slider, q its travel along n' from the guide's foot b = r + ob u(phi + beta_b).
// Closure (m): distance from base point to slider, less the link:
// |b + q n(phi + beta_b) - A| - L.  Working mode: sign of n' . (distal link, from base point to
// slider), as for the other two.
struct RrpActive3 : PlanarLeg<kDistalLength, kBaseRadius, kBaseAngle, kPlatformGuideDistance,
                              kPlatformGuideAngle> {
  // L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "RR[P]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_platform;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(phi + beta_b) . (distal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b) + q * normal(pose.phi + beta_b)) - L;
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, beta, ob, beta_b);
    const T across = dot(direction(pose.phi + beta_b), d);
    return mode * triangle_leg(L, across) - dot(normal(pose.phi + beta_b), d);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return RrpActive1::reach_margin(geometry, pose);
  }

  // The last point is the guide's foot.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> foot = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), foot + q * normal(pose.phi + beta_b), foot);
  }
};

using RrpChains = ChainList<RrpActive1, RrpActive2, RrpActive3>;

}  // namespace symkin
