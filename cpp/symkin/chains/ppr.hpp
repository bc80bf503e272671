// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/planar.hpp"

namespace symkin {

// [P]PR: two guides at a fixed angle on the base, a pivot at the platform point b. q is the
// distance from the origin O, along u(beta), of the line on which the passive guide holds b.
// Closure (m):  u(beta) . b - q.  The sensor counts travel along the actuated guide; the sine of
// the angle between the guides is part of its gain, where the actuated guide starts part of its
// offset. One root, everywhere within reach; the working mode is ignored.
struct PprActive1 : PlanarLeg<kBaseGuideAngle, kPlatformRadius, kPlatformAngle> {
  // beta, ob, beta_b
  static constexpr std::string_view kName = "[P]PR";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the distance is the only root";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [beta, ob, beta_b] = geometry;
    return beyond_base_guide(platform_point(pose, ob, beta_b), q, beta);
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    const auto& [beta, ob, beta_b] = geometry;
    return dot(direction(beta), platform_point(pose, ob, beta_b));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  // Drawn with guides at right angles: the origin, the foot of the passive guide, the pivot.
  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [beta, ob, beta_b] = geometry;
    return centres(Vec2<double>{0, 0}, polar(q, beta), platform_point(pose, ob, beta_b));
  }
};

// P[P]R: the same closure; here the passive guide stands on the base and carries the actuated one.
struct PprActive2 : PprActive1 {
  static constexpr std::string_view kName = "P[P]R";
};

using PprChains = ChainList<PprActive1, PprActive2>;

}  // namespace symkin
