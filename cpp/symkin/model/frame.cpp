// SPDX-License-Identifier: MIT
#include "symkin/model/frame.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "symkin/model/pose.hpp"

namespace symkin {

Frame Frame::inverse() const { return {-(rotation.transpose() * position), rotation.transpose()}; }

Frame operator*(const Frame& outer, const Frame& inner) {
  return {outer.position + outer.rotation * inner.position, outer.rotation * inner.rotation};
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle == 0) {
    return Eigen::Matrix3d::Identity();
  }
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

Frame moved(const Frame& frame, const Eigen::Matrix<double, 6, 1>& step) {
  // Kept orthonormal through thousands of steps by the quaternion.
  const Eigen::Quaterniond turned(rotation_of(step.tail<3>()) * frame.rotation);
  return {frame.position + step.head<3>(), turned.normalized().toRotationMatrix()};
}

const std::vector<Index>& pose_slots(PoseSpace space) {
  static const std::vector<Index> planar{0, 1, 5};
  static const std::vector<Index> point{0, 1};
  static const std::vector<Index> translating{0, 1, 2};
  static const std::vector<Index> spherical{3, 4, 5};
  static const std::vector<Index> schoenflies{0, 1, 2, 5};
  static const std::vector<Index> spatial{0, 1, 2, 3, 4, 5};
  switch (space) {
    case PoseSpace::planar:
      return planar;
    case PoseSpace::point:
      return point;
    case PoseSpace::translating:
      return translating;
    case PoseSpace::spherical:
      return spherical;
    case PoseSpace::schoenflies:
      return schoenflies;
    case PoseSpace::spatial:
      break;
  }
  return spatial;
}

const std::vector<Index>& frame_slots(PoseSpace space) {
  // A frame turns where the platform does not.
  return pose_slots(position_size(space) == 2   ? PoseSpace::planar
                    : position_size(space) == 0 ? PoseSpace::spherical
                                                : PoseSpace::spatial);
}

Frame frame_of_pose(PoseSpace space, const double* pose) {
  Frame frame;
  frame.position.head(position_size(space)) = Eigen::Map<const Vector>(pose, position_size(space));
  if (has_angle(space)) {
    frame.rotation.topLeftCorner<2, 2>() =
        Eigen::Rotation2Dd(pose[position_size(space)]).toRotationMatrix();
  } else if (has_quaternion(space)) {
    frame.rotation = rotation_matrix(pose + position_size(space));
  }
  return frame;
}

void pose_of_frame(PoseSpace space, const Frame& frame, double* pose) {
  Eigen::Map<Vector>(pose, position_size(space)) = frame.position.head(position_size(space));
  if (has_angle(space)) {
    pose[position_size(space)] = std::atan2(frame.rotation(1, 0), frame.rotation(0, 0));
  } else if (has_quaternion(space)) {
    const Eigen::Quaterniond turn(frame.rotation);
    Eigen::Map<Eigen::Vector4d>(pose + position_size(space)) = turn.coeffs();
  }
}

}  // namespace symkin
