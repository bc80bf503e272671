// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// Two links between a base point A and a platform point b, d = b - A. Whichever joint is
// actuated, the working mode is the sign of (link on the base side) x (link on the platform
// side), the turn of the elbow, and the reach ends at the stretched and at the folded dyad.

// [R]RR: crank on the base, q its direction in the base frame. Closure (m): distance from the
// elbow to the platform point, less the distal length:  |d - l u(q)| - L.  Stands for the paper's
// Eq. 17, which is one of the possible loop equations. Working mode: sign of (proximal link) x
// (distal link), the turn of the elbow; -1 is q = angle(d) + acos((l^2 + |d|^2 - L^2) / (2 l |d|)).
struct RrrActive1 : PlanarLeg<kProximalLength, kDistalLength, kBaseRadius, kBaseAngle,
                              kPlatformRadius, kPlatformAngle> {
  // l, L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "[R]RR";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of (proximal link) x (distal link), the turn of the elbow";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b) - polar(l, q)) - L;
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, beta, ob, beta_b);
    return azimuth(d) + arc_cosine(triangle_cosine(l, norm(d), L), -mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    return dyad_margin(l, L, norm(leg_vector(pose, OA, beta, ob, beta_b)));
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> base = polar(OA, beta);
    return centres(base, base + polar(l, q), platform_point(pose, ob, beta_b));
  }
};

// R[R]R: actuated elbow, q the angle from the proximal to the distal link. Closure (m): length of
// d less what the two links span:  |d| - sqrt(l^2 + L^2 + 2 l L cos q).  Working mode: sign of
// (proximal link) x (distal link), hence of sin q.
struct RrrActive2 : PlanarLeg<kProximalLength, kDistalLength, kBaseRadius, kBaseAngle,
                              kPlatformRadius, kPlatformAngle> {
  // l, L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "R[R]R";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::elbow_angle;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of (proximal link) x (distal link), the turn of the elbow";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    using std::sqrt;
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b)) -
           sqrt(l * l + L * L + 2.0 * l * L * q.cosine);
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    using std::acos;
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, beta, ob, beta_b);
    return arc_cosine((dot(d, d) - l * l - L * L) / (2.0 * l * L), mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return RrrActive1::reach_margin(geometry, pose);
  }

  // The links turn by q at the elbow; they meet the base point exactly, and the platform point
  // when q closes the leg.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> d = leg_vector(pose, OA, beta, ob, beta_b);
    const Azimuth<double> span = azimuth(Vec2<double>{l, 0} + polar(L, q));
    const Vec2<double> base = polar(OA, beta);
    return centres(base, base + polar(l, azimuth(d) - span), base + d);
  }
};

// RR[R]: actuated joint at the platform, q the direction of the link on the platform side, from
// the platform point to the elbow, in the platform frame; that link is the proximal one, next to
// the actuated joint. Closure (m): distance from the base point to the elbow, less the distal
// length:  |b + l u(phi + q) - A| - L.  Working mode: sign of (link on the base side) x (link on
// the platform side), the turn of the elbow, as for the other two.
struct RrrActive3 : PlanarLeg<kProximalLength, kDistalLength, kBaseRadius, kBaseAngle,
                              kPlatformRadius, kPlatformAngle> {
  // l, L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "RR[R]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_platform;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of (distal link, on the base side) x (proximal link, on the platform side), the "
      "turn of the elbow";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b) + polar(l, pose.phi + q)) - L;
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> to_base = -leg_vector(pose, OA, beta, ob, beta_b);
    return azimuth(to_base) + arc_cosine(triangle_cosine(l, norm(to_base), L), mode) - pose.phi;
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return RrrActive1::reach_margin(geometry, pose);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [l, L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> b = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), b + polar(l, pose.phi + q), b);
  }
};

using RrrChains = ChainList<RrrActive1, RrrActive2, RrrActive3>;

}  // namespace symkin
