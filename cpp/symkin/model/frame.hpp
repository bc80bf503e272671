// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/pose_space.hpp"

namespace symkin {

// A frame in space: where its origin is, and how it is turned, p_outer = position + rotation p.
// Planar mechanisms live in z = 0 and turn about Z.
struct Frame {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();

  Frame inverse() const;
  // This frame, given in `outer`, as outer * inner.
  friend Frame operator*(const Frame& outer, const Frame& inner);
};

// exp([w]): the rotation by |w| about w.
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& w);

// The frame moved by a tangent vector of six: position, then R <- exp([w]) R.
Frame moved(const Frame& frame, const Eigen::Matrix<double, 6, 1>& step);

// Which of those six components a pose, or the frames of a mechanism of that pose space, have.
const std::vector<Index>& pose_slots(PoseSpace space);
const std::vector<Index>& frame_slots(PoseSpace space);

// A row of a pose array as a frame, and back.
Frame frame_of_pose(PoseSpace space, const double* pose);
void pose_of_frame(PoseSpace space, const Frame& frame, double* pose);

}  // namespace symkin
