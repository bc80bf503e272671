// SPDX-License-Identifier: MIT
#include "symkin/model/pose_space.hpp"

#include <Eigen/Geometry>

#include "symkin/model/pose.hpp"

namespace symkin {
namespace {

Eigen::Quaterniond quaternion(const double* pose) { return {pose[6], pose[3], pose[4], pose[5]}; }

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
  switch (space) {
    case PoseSpace::planar:
      return PlanarPose<double>::move(step, pose);
    case PoseSpace::point:
      return PointPose<double>::move(step, pose);
    case PoseSpace::spatial:
      return SpatialPose<double>::move(step, pose);
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
