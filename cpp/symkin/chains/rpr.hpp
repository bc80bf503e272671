// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// A slider between a base point A and a platform point b, d = b - A.

// [R]PR: a guide turns about the base point at the distance e from it, q the direction of its
// normal in the base frame. Closure (m): distance of the platform point from the guide:
// u(q) . d - e.  Working mode: sign of n(q) . d, on which side of the guide's foot the slider is.
// Reach: the platform point stays farther than |e| from the base point.
struct RprActive1
    : PlanarLeg<kGuideOffset, kBaseRadius, kBaseAngle, kPlatformRadius, kPlatformAngle> {
  // e, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "[R]PR";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(q) . d, the slider's travel from the guide's foot";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    return dot(direction(q), leg_vector(pose, OA, beta, ob, beta_b)) - e;
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, beta, ob, beta_b);
    return azimuth(d) + arc_cosine(e / norm(d), -mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    using std::abs;
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b)) - abs(e);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> base = polar(OA, beta);
    return centres(base, base + polar(e, q), platform_point(pose, ob, beta_b));
  }
};

// R[P]R: telescopic leg, q its length. Closure (m): distance of the two points less the length:
// |d| - q.  The length is the only root, everywhere within reach; the working mode is ignored.
struct RprActive2 : PlanarLeg<kBaseRadius, kBaseAngle, kPlatformRadius, kPlatformAngle> {
  // OA, beta, ob, beta_b
  static constexpr std::string_view kName = "R[P]R";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the length is the only root";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b)) - q;
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  // The slider is drawn in the middle of the leg.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double /*q*/) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    const Vec2<double> base = polar(OA, beta);
    const Vec2<double> b = platform_point(pose, ob, beta_b);
    return centres(base, 0.5 * (base + b), b);
  }
};

// RP[R]: [R]PR upside down: the guide turns about the platform point, q the direction of
// its normal in the platform frame. Closure (m): distance of the base point from the guide:
// -u(phi + q) . d - e.  Working mode: sign of -n(phi + q) . d, on which side of the guide's foot
// the slider, now at the base point, is.
// Reach as [R]PR.
struct RprActive3
    : PlanarLeg<kGuideOffset, kBaseRadius, kBaseAngle, kPlatformRadius, kPlatformAngle> {
  // e, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "RP[R]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_platform;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of -n(phi + q) . d, the slider's travel from the guide's foot";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    return -dot(direction(pose.phi + q), leg_vector(pose, OA, beta, ob, beta_b)) - e;
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> to_base = -leg_vector(pose, OA, beta, ob, beta_b);
    return azimuth(to_base) + arc_cosine(e / norm(to_base), -mode) - pose.phi;
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return RprActive1::reach_margin(geometry, pose);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [e, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> b = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), b + polar(e, pose.phi + q), b);
  }
};

using RprChains = ChainList<RprActive1, RprActive2, RprActive3>;

}  // namespace symkin
