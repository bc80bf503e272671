// SPDX-License-Identifier: MIT
#include "symkin/model/pose_space.hpp"

#include <Eigen/Geometry>

namespace symkin {
namespace {

Eigen::Quaterniond quaternion(const double* pose) { return {pose[6], pose[3], pose[4], pose[5]}; }

Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  // sin(a/2)/a by its series where the quotient loses digits.
  const double scale = angle < 1e-6 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
  const Eigen::Vector3d v = scale * w;
  return {std::cos(angle / 2), v.x(), v.y(), v.z()};
}

Eigen::Vector3d to_rotation_vector(Eigen::Quaterniond q) {
  if (q.w() < 0) {
    q.coeffs() *= -1;
  }
  const double sine = q.vec().norm();
  const double scale = sine < 1e-9 ? 2.0 / q.w() : 2 * std::atan2(sine, q.w()) / sine;
  return scale * q.vec();
}

}  // namespace

std::string_view to_string(PoseSpace space) {
  switch (space) {
    case PoseSpace::planar:
      return "planar";
    case PoseSpace::point:
      return "point";
    case PoseSpace::spatial:
      break;
  }
  return "spatial";
}

Index coordinate_count(PoseSpace space) {
  return space == PoseSpace::planar ? 3 : space == PoseSpace::point ? 2 : 7;
}

Index degrees_of_freedom(PoseSpace space) {
  return space == PoseSpace::planar ? 3 : space == PoseSpace::point ? 2 : 6;
}

Index position_size(PoseSpace space) { return space == PoseSpace::spatial ? 3 : 2; }

Vector identity_pose(PoseSpace space) {
  Vector pose = Vector::Zero(coordinate_count(space));
  if (space == PoseSpace::spatial) {
    pose[6] = 1;
  }
  return pose;
}

void move_pose(PoseSpace space, const double* step, double* pose) {
  const Index linear = space == PoseSpace::spatial ? 3 : degrees_of_freedom(space);
  for (Index i = 0; i < linear; ++i) {
    pose[i] += step[i];
  }
  if (space == PoseSpace::spatial) {
    const Eigen::Quaterniond turned =
        (from_rotation_vector({step[3], step[4], step[5]}) * quaternion(pose)).normalized();
    Eigen::Map<Eigen::Vector4d>(pose + 3) = turned.coeffs();
  }
}

void pose_difference(PoseSpace space, const double* to, const double* from, double* difference) {
  const Index position = position_size(space);
  for (Index i = 0; i < position; ++i) {
    difference[i] = to[i] - from[i];
  }
  if (space == PoseSpace::planar) {
    difference[2] = wrap_angle(to[2] - from[2]);
  } else if (space == PoseSpace::spatial) {
    Eigen::Map<Eigen::Vector3d>(difference + 3) = to_rotation_vector(
        (quaternion(to).normalized() * quaternion(from).normalized().conjugate()).normalized());
  }
}

}  // namespace symkin
