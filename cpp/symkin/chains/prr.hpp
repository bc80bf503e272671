// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// A guide on the base, the line u(beta) . p = OA, with a slider, and a link from the slider to
// the platform point b. Whichever joint is actuated, the working mode is the sign of
// n(beta) . (link), whether the link leans along the guide's travel or against it, and the reach
// ends where the platform point is a link's length away from the guide.

// [P]RR: actuated slider, q its travel along n(beta) from the guide's foot A = OA u(beta).
// Closure (m): distance from slider to platform point, less the link:  |b - A - q n(beta)| - L.
// Working mode: sign of n(beta) . (distal link); -1 is the slider ahead of the platform point.
struct PrrActive1 : PlanarLeg<kDistalLength, kBaseGuideDistance, kBaseGuideAngle, kPlatformRadius,
                              kPlatformAngle> {
  // L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "[P]RR";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(beta) . (distal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, beta, ob, beta_b) - q * normal(beta)) - L;
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, beta, ob, beta_b);
    return dot(normal(beta), d) - mode * triangle_leg(L, dot(direction(beta), d));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    using std::abs;
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    return L - abs(beyond_base_guide(platform_point(pose, ob, beta_b), OA, beta));
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> foot = polar(OA, beta);
    return centres(foot, foot + q * normal(beta), platform_point(pose, ob, beta_b));
  }
};

// P[R]R: actuated joint at the slider, q the direction of the link, from slider to platform point,
// in the base frame. Closure (m): distance of the slider from the guide:
// u(beta) . (b - L u(q)) - OA.  Working mode: sign of n(beta) . (distal link), hence of
// sin(q - beta).
struct PrrActive2 : PlanarLeg<kDistalLength, kBaseGuideDistance, kBaseGuideAngle, kPlatformRadius,
                              kPlatformAngle> {
  // L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "P[R]R";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(beta) . (distal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    return beyond_base_guide(platform_point(pose, ob, beta_b) - polar(L, q), OA, beta);
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const T beyond = beyond_base_guide(platform_point(pose, ob, beta_b), OA, beta);
    return beta + arc_cosine(beyond / L, mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return PrrActive1::reach_margin(geometry, pose);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> b = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), b - polar(L, q), b);
  }
};

// PR[R]: actuated joint at the platform, q the direction of the link, from platform point to
// slider, in the platform frame. Closure (m): distance of the slider from the guide:
// u(beta) . (b + L u(phi + q)) - OA.  Working mode: sign of n(beta) . (distal link from slider to
// platform point), as for the other two, hence of -sin(phi + q - beta).
struct PrrActive3 : PlanarLeg<kDistalLength, kBaseGuideDistance, kBaseGuideAngle, kPlatformRadius,
                              kPlatformAngle> {
  // L, OA, beta, ob, beta_b
  static constexpr std::string_view kName = "PR[R]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::angle_in_platform;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode =
      "sign of n(beta) . (distal link), its lean along the guide's travel";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    return beyond_base_guide(platform_point(pose, ob, beta_b) + polar(L, pose.phi + q), OA, beta);
  }

  template <typename T>
  static Azimuth<T> root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const T beyond = beyond_base_guide(platform_point(pose, ob, beta_b), OA, beta);
    return beta + arc_cosine(-beyond / L, -mode) - pose.phi;
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return PrrActive1::reach_margin(geometry, pose);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    const Azimuth<double>& q) {
    const auto& [L, OA, beta, ob, beta_b] = geometry;
    const Vec2<double> b = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), b + polar(L, pose.phi + q), b);
  }
};

using PrrChains = ChainList<PrrActive1, PrrActive2, PrrActive3>;

}  // namespace symkin
