// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// U[P]S: the leg of a hexapod, or a cable. Closure (m): distance between base and platform point,
// less the leg's length:  |w| - q.  A point is given by its distance from the origin, its polar
// angle from Z and its azimuth (conditions 4 and 5 of the paper's section 5). The length is the
// only root.
struct UpsActive2 {
  using ForTranslating = LegGeometry<kBaseRadius, kBasePolarAngle, kBaseAzimuth>;
  using ForRigid = LegGeometry<kBaseRadius, kBasePolarAngle, kBaseAzimuth, kPlatformRadius,
                               kPlatformPolarAngle, kPlatformAzimuth>;
  static constexpr std::string_view kName = "U[P]S";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the length is the only root";

  template <typename Own>
  static auto base_point(const Own& own) {
    const auto& [OA, alpha, beta] = own;
    return point_at(OA, alpha, beta);
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& /*own*/, const Vec3<W>& w, const Q& q) {
    return norm(w) - q;
  }

  template <typename Own, typename T>
  static T root(const Own& /*own*/, const Vec3<T>& w, const T& /*mode*/) {
    return norm(w);
  }

  template <typename Own, typename T>
  static T reach_margin(const Own& /*own*/, const Vec3<T>& /*w*/) {
    return T(kUnlimitedReach);
  }

  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, double /*q*/) {
    const Vec3<double> base = base_point(own);
    return centres_in_space(base, base + w);
  }
};

using UpsChains = SpatialChains<UpsActive2>;

}  // namespace symkin
