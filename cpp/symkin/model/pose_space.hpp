// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <string_view>

#include "symkin/model/lanes.hpp"
#include "symkin/model/roles.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

std::string_view to_string(PoseSpace space);
Index coordinate_count(PoseSpace space);
Index degrees_of_freedom(PoseSpace space);
Index position_size(PoseSpace space);
// Whether the platform turns, so that its orientation is among the coordinates.
inline bool has_orientation(PoseSpace space) {
  return degrees_of_freedom(space) > position_size(space);
}

// Whether the orientation is one angle about Z, behind the position.
inline bool has_angle(PoseSpace space) {
  return degrees_of_freedom(space) == position_size(space) + 1;
}

// Whether the orientation is a quaternion, behind the position.
inline bool has_quaternion(PoseSpace space) {
  return degrees_of_freedom(space) == position_size(space) + 3;
}

// The pose at the origin without rotation.
Vector identity_pose(PoseSpace space);

// pose <- pose moved by the tangent vector `step`.
void move_pose(PoseSpace space, const double* step, double* pose);

// The tangent vector that moves `from` to `to`; orientations differ by the shortest rotation.
void pose_difference(PoseSpace space, const double* to, const double* from, double* difference);

// The rotation vector of the shortest rotation: rotation_of() the other way round.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

// Left Jacobian of the rotation vector w: exp(w + J^-1 d) = exp(d) exp(w) to first order.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w);

// Angle in (-pi, pi].
template <typename T>
T wrap_angle(const T& angle) {
  using std::floor;
  constexpr double kTwoPi = 6.283185307179586476925;
  const T wrapped = angle - kTwoPi * floor(angle / kTwoPi + 0.5);
  return Lanes<T>::select(wrapped <= T(-kTwoPi / 2), wrapped + kTwoPi, wrapped);
}

}  // namespace symkin
