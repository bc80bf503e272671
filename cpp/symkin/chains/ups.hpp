// SPDX-License-Identifier: MIT
#pragma once

#include <array>
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
  template <typename T>
  using Vec3 = Eigen::Matrix<T, 3, 1>;

  template <typename T>
  static T closure(const Geometry<T>& geometry, const Pose<T>& pose, const T& q) {
    return leg_vector(geometry, pose).norm() - q;
  }

  static double root(const Geometry<double>& geometry, const Pose<double>& pose, int /*mode*/) {
    return leg_vector(geometry, pose).norm();
  }

  static double reach_margin(const Geometry<double>& /*geometry*/, const Pose<double>& /*pose*/) {
    return std::numeric_limits<double>::infinity();
  }

  static std::array<Vec3<double>, 2> joint_centres(const Geometry<double>& geometry,
                                                   const Pose<double>& pose, double /*q*/) {
    const auto& [OA, alpha, beta, ob, alpha_b, beta_b] = geometry;
    const Vec3<double> base = spherical(OA, alpha, beta);
    return {base, base + leg_vector(geometry, pose)};
  }

 private:
  template <typename T>
  static Vec3<T> spherical(const T& radius, const Azimuth<T>& polar_angle,
                           const Azimuth<T>& azimuth) {
    return {radius * polar_angle.sine * azimuth.cosine, radius * polar_angle.sine * azimuth.sine,
            radius * polar_angle.cosine};
  }

  template <typename T>
  static Vec3<T> leg_vector(const Geometry<T>& geometry, const Pose<T>& pose) {
    const auto& [OA, alpha, beta, ob, alpha_b, beta_b] = geometry;
    return pose.position + pose.rotation * spherical(ob, alpha_b, beta_b) -
           spherical(OA, alpha, beta);
  }
};

using UpsChains = ChainList<UpsActive2>;

}  // namespace symkin
