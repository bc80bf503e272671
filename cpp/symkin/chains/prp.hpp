// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// A guide on the base, the line u(beta) . p = OA, crosses a guide on the platform, the line
// u(beta_b) . p = ob of the platform frame, with a pivot between their sliders. The pivot is the
// guides' crossing, the only root; the working mode is ignored. The reach is unlimited; where the
// guides are parallel the travel grows beyond all bounds (not finite when exactly parallel).

// [P]RP: actuated slider on the base, q its travel along n(beta) from the guide's foot
// A = OA u(beta). Closure (m): distance of the pivot from the platform's guide:
// u(phi + beta_b) . (A + q n(beta) - r) - ob.
struct PrpActive1
    : PlanarLeg<kBaseGuideDistance, kBaseGuideAngle, kPlatformGuideDistance, kPlatformGuideAngle> {
  // OA, beta, ob, beta_b
  static constexpr std::string_view kName = "[P]RP";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_base;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode =
      "without meaning: the crossing of the guides is the only root";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return beyond_platform_guide(polar(OA, beta) + q * normal(beta), pose, ob, beta_b);
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return -beyond_platform_guide(polar(OA, beta), pose, ob, beta_b) /
           dot(direction(pose.phi + beta_b), normal(beta));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  // The feet of the two guides, and the pivot between them.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    const Vec2<double> foot = polar(OA, beta);
    return centres(foot, foot + q * normal(beta), platform_point(pose, ob, beta_b));
  }
};

// PR[P]: actuated slider on the platform, q its travel along n(phi + beta_b) from the guide's foot
// b = r + ob u(phi + beta_b). Closure (m): distance of the pivot from the base's guide:
// u(beta) . (b + q n(phi + beta_b)) - OA.
struct PrpActive3
    : PlanarLeg<kBaseGuideDistance, kBaseGuideAngle, kPlatformGuideDistance, kPlatformGuideAngle> {
  // OA, beta, ob, beta_b
  static constexpr std::string_view kName = "PR[P]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_platform;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode =
      "without meaning: the crossing of the guides is the only root";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return beyond_base_guide(platform_point(pose, ob, beta_b) + q * normal(pose.phi + beta_b), OA,
                             beta);
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    return -beyond_base_guide(platform_point(pose, ob, beta_b), OA, beta) /
           dot(direction(beta), normal(pose.phi + beta_b));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    const Vec2<double> foot = platform_point(pose, ob, beta_b);
    return centres(polar(OA, beta), foot + q * normal(pose.phi + beta_b), foot);
  }
};

using PrpChains = ChainList<PrpActive1, PrpActive3>;

}  // namespace symkin
