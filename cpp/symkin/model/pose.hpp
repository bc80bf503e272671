// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "symkin/model/azimuth.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// The pose as the closures see it. `constant` reads a row as it is; `variable` makes the tangent
// the derivative directions `first`, `first + 1`, ... of the autodiff scalar T.
template <typename T>
struct PlanarPose {
  static constexpr PoseSpace kSpace = PoseSpace::planar;
  static constexpr int kCoordinates = 3;
  static constexpr int kDof = 3;
  static PlanarPose constant(const double* row) {
    return {T(row[0]), T(row[1]), Azimuth<T>(T(row[2]))};
  }
  static PlanarPose variable(const double* row, int first) {
    return {T(row[0], first), T(row[1], first + 1), Azimuth<T>(T(row[2], first + 2))};
  }

  T x, y;
  Azimuth<T> phi;
};

// Position alone: the platform is a point, or does not turn.
template <typename T>
struct PointPose {
  static constexpr PoseSpace kSpace = PoseSpace::point;
  static constexpr int kCoordinates = 2;
  static constexpr int kDof = 2;
  static PointPose constant(const double* row) { return {T(row[0]), T(row[1])}; }
  static PointPose variable(const double* row, int first) {
    return {T(row[0], first), T(row[1], first + 1)};
  }

  T x, y;
};

template <typename T>
struct SpatialPose {
  static constexpr PoseSpace kSpace = PoseSpace::spatial;
  static constexpr int kCoordinates = 7;
  static constexpr int kDof = 6;
  static SpatialPose constant(const double* row) {
    return {Eigen::Vector3d(row[0], row[1], row[2]).cast<T>(), rotation_matrix(row).cast<T>()};
  }

  // To first order exp([w]) R = R + [w] R, which is all that a derivative at w = 0 needs.
  static SpatialPose variable(const double* row, int first) {
    SpatialPose pose = constant(row);
    for (int i = 0; i < 3; ++i) {
      pose.position[i].v[first + i] = 1.0;
    }
    const Eigen::Matrix3d rotation = rotation_matrix(row);
    for (int column = 0; column < 3; ++column) {
      const Eigen::Vector3d axis = rotation.col(column);
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d derivative = Eigen::Vector3d::Unit(i).cross(axis);
        for (int k = 0; k < 3; ++k) {
          pose.rotation(k, column).v[first + 3 + i] = derivative[k];
        }
      }
    }
    return pose;
  }

  static Eigen::Matrix3d rotation_matrix(const double* row) {
    return Eigen::Quaterniond(row[6], row[3], row[4], row[5]).normalized().toRotationMatrix();
  }

  Eigen::Matrix<T, 3, 1> position;
  Eigen::Matrix<T, 3, 3> rotation;
};

}  // namespace symkin
