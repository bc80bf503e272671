// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "symkin/model/leg_geometry.hpp"
#include "symkin/model/parameters.hpp"
#include "symkin/model/pose.hpp"

namespace symkin {

// U[P]S: the leg of a hexapod. Closure (m): distance between base and platform point, less the
// leg's length:  |r + R b - A| - q.  A point is given by its radius, its polar angle from Z and
// its azimuth (conditions 4 and 5 of the paper's section 5). The length is the only root.
struct UpsActive2 : LegGeometry<kBaseRadius, kBasePolarAngle, kBaseAzimuth, kPlatformRadius,
                                kPlatformPolarAngle, kPlatformAzimuth> {
  // OA, alpha, beta, ob, alpha_b, beta_b
  static constexpr std::string_view kName = "U[P]S";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the length is the only root";
  template <typename T>
  using Pose = SpatialPose<T>;

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    return length(leg_vector<G>(geometry, pose)) - q;
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    return length(leg_vector<T>(geometry, pose));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(std::numeric_limits<double>::infinity());
  }

  static std::array<Eigen::Vector3d, 2> joint_centres(const Geometry<double>& geometry,
                                                      const Pose<double>& pose, double /*q*/) {
    const auto& [OA, alpha, beta, ob, alpha_b, beta_b] = geometry;
    const Vec3<double> base = spherical(OA, alpha, beta);
    const Vec3<double> leg = leg_vector<double>(geometry, pose);
    const Eigen::Vector3d foot(base[0], base[1], base[2]);
    return {foot, foot + Eigen::Vector3d(leg[0], leg[1], leg[2])};
  }

 private:
  template <typename T>
  using Vec3 = std::array<T, 3>;

  template <typename T>
  static T length(const Vec3<T>& a) {
    using std::sqrt;
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  }

  template <typename T>
  static Vec3<T> spherical(const T& radius, const Azimuth<T>& polar_angle,
                           const Azimuth<T>& azimuth) {
    return {radius * polar_angle.sine * azimuth.cosine, radius * polar_angle.sine * azimuth.sine,
            radius * polar_angle.cosine};
  }

  template <typename G, typename T>
  static Vec3<T> leg_vector(const Geometry<G>& geometry, const Pose<T>& pose) {
    const auto& [OA, alpha, beta, ob, alpha_b, beta_b] = geometry;
    const Vec3<G> a = spherical(OA, alpha, beta);
    const Vec3<G> b = spherical(ob, alpha_b, beta_b);
    Vec3<T> d;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& row = pose.rotation[i];
      d[i] = pose.position[i] + row[0] * b[0] + row[1] * b[1] + row[2] * b[2] - a[i];
    }
    return d;
  }
};

using UpsChains = ChainList<UpsActive2>;

}  // namespace symkin
