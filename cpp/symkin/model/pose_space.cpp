// SPDX-License-Identifier: MIT
#include "symkin/model/pose_space.hpp"

#include <Eigen/Geometry>

#include "symkin/model/pose.hpp"

namespace symkin {
namespace {

// (x, y, z, w)
Eigen::Quaterniond quaternion(const double* row) { return {row[3], row[0], row[1], row[2]}; }

Eigen::Vector3d to_rotation_vector(Eigen::Quaterniond q) {
  if (q.w() < 0) {
    q.coeffs() *= -1;
  }
  const double sine = q.vec().norm();
  const double scale = sine < 1e-9 ? 2.0 / q.w() : 2 * std::atan2(sine, q.w()) / sine;
  return scale * q.vec();
}

// What `visit` says of the type of poses: the one place that lists them.
template <typename Visitor>
auto of_type(PoseSpace space, const Visitor& visit) {
  switch (space) {
    case PoseSpace::planar:
      return visit(PlanarPose<double>());
    case PoseSpace::point:
      return visit(PointPose<double>());
    case PoseSpace::translating:
      return visit(TranslatingPose<double>());
    case PoseSpace::spherical:
      return visit(SphericalPose<double>());
    case PoseSpace::schoenflies:
      return visit(SchoenfliesPose<double>());
    case PoseSpace::spatial:
      break;
  }
  return visit(SpatialPose<double>());
}

}  // namespace

std::string_view to_string(PoseSpace space) {
  return of_type(space, [](auto pose) { return decltype(pose)::kName; });
}

Index coordinate_count(PoseSpace space) {
  return of_type(space, [](auto pose) { return Index{decltype(pose)::kCoordinates}; });
}

Index degrees_of_freedom(PoseSpace space) {
  return of_type(space, [](auto pose) { return Index{decltype(pose)::kDof}; });
}

Index position_size(PoseSpace space) {
  return of_type(space, [](auto pose) { return Index{decltype(pose)::kPosition}; });
}

Vector identity_pose(PoseSpace space) {
  Vector pose = Vector::Zero(coordinate_count(space));
  if (has_quaternion(space)) {
    pose[pose.size() - 1] = 1;
  }
  return pose;
}

void move_pose(PoseSpace space, const double* step, double* pose) {
  of_type(space, [&](auto type) { decltype(type)::move(step, pose); });
}

void pose_difference(PoseSpace space, const double* to, const double* from, double* difference) {
  const Index position = position_size(space);
  for (Index i = 0; i < position; ++i) {
    difference[i] = to[i] - from[i];
  }
  if (has_angle(space)) {
    difference[position] = wrap_angle(to[position] - from[position]);
  } else if (has_quaternion(space)) {
    Eigen::Map<Eigen::Vector3d>(difference + position) =
        to_rotation_vector((quaternion(to + position).normalized() *
                            quaternion(from + position).normalized().conjugate())
                               .normalized());
  }
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  return to_rotation_vector(Eigen::Quaterniond(rotation).normalized());
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  Eigen::Matrix3d cross;
  cross << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  const double square = angle * angle;
  // The series where the quotients lose digits.
  const bool small = angle < 0.02;
  const double a = small ? 0.5 - square / 24 * (1 - square / 30) : (1 - std::cos(angle)) / square;
  const double b = small ? 1.0 / 6 - square / 120 * (1 - square / 42)
                         : (angle - std::sin(angle)) / (square * angle);
  return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
}

}  // namespace symkin
