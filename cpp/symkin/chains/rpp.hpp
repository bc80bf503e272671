// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// RP[P]: a pivot at the base point A, two guides at a fixed angle on the platform. q is the
// distance from the platform's origin o, along u(phi + beta_b), of the line on which the passive
// guide holds A. Closure (m):  u(phi + beta_b) . (A - r) - q.  The sensor counts travel along the
// actuated guide; the sine of the angle between the guides is part of its gain, where the
// actuated guide starts part of its offset. One root, everywhere within reach; the working mode
// is ignored.
struct RppActive3 : PlanarLeg<kBaseRadius, kBaseAngle, kPlatformGuideAngle> {
  // OA, beta, beta_b
  static constexpr std::string_view kName = "RP[P]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the distance is the only root";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [OA, beta, beta_b] = geometry;
    return beyond_platform_guide(polar(OA, beta), pose, q, beta_b);
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    const auto& [OA, beta, beta_b] = geometry;
    return dot(direction(pose.phi + beta_b), polar(OA, beta) - position(pose));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  // Drawn with guides at right angles: the pivot, the foot of the passive guide, the platform's
  // origin.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [OA, beta, beta_b] = geometry;
    const Vec2<double> origin = position(pose);
    return centres(polar(OA, beta), origin + polar(q, pose.phi + beta_b), origin);
  }
};

// R[P]P: the same closure; here the passive guide stands on the platform and carries the actuated
// one.
struct RppActive2 : RppActive3 {
  static constexpr std::string_view kName = "R[P]P";
};

using RppChains = ChainList<RppActive2, RppActive3>;

}  // namespace symkin
