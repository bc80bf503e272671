// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "symkin/model/azimuth.hpp"
#include "symkin/model/dual.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// The pose as the closures see it. `constant` reads coordinates as they are; `variable` makes the
// tangent the derivative directions `first`, `first + 1`, ... of the dual T; `move` takes a step on
// the tangent.
template <typename T>
struct PlanarPose {
  static constexpr PoseSpace kSpace = PoseSpace::planar;
  static constexpr std::string_view kName = "planar";
  static constexpr int kPosition = 2;
  static constexpr int kCoordinates = 3;
  static constexpr int kDof = 3;
  static PlanarPose constant(const T* row) { return {row[0], row[1], Azimuth<T>(row[2])}; }
  template <typename S>
  static PlanarPose variable(const S* row, int first) {
    return {T(row[0], first), T(row[1], first + 1), Azimuth<T>(T(row[2], first + 2))};
  }
  static void move(const T* step, T* row) {
    for (int i = 0; i < kDof; ++i) {
      row[i] = row[i] + step[i];
    }
  }

  T x, y;
  Azimuth<T> phi;
};

// Position alone, in the plane: the platform is a point, or does not turn.
template <typename T>
struct PointPose {
  static constexpr PoseSpace kSpace = PoseSpace::point;
  static constexpr std::string_view kName = "point";
  static constexpr int kPosition = 2;
  static constexpr int kCoordinates = 2;
  static constexpr int kDof = 2;
  static PointPose constant(const T* row) { return {row[0], row[1]}; }
  template <typename S>
  static PointPose variable(const S* row, int first) {
    return {T(row[0], first), T(row[1], first + 1)};
  }
  static void move(const T* step, T* row) {
    row[0] = row[0] + step[0];
    row[1] = row[1] + step[1];
  }

  T x, y;
};

// Position alone, in space: the platform never turns (delta).
template <typename T>
struct TranslatingPose {
  static constexpr PoseSpace kSpace = PoseSpace::translating;
  static constexpr std::string_view kName = "translating";
  static constexpr int kPosition = 3;
  static constexpr int kCoordinates = 3;
  static constexpr int kDof = 3;
  static TranslatingPose constant(const T* row) { return {{row[0], row[1], row[2]}}; }
  template <typename S>
  static TranslatingPose variable(const S* row, int first) {
    return {{T(row[0], first), T(row[1], first + 1), T(row[2], first + 2)}};
  }
  static void move(const T* step, T* row) {
    for (int i = 0; i < kDof; ++i) {
      row[i] = row[i] + step[i];
    }
  }

  std::array<T, 3> position;
};

template <typename T>
struct SpatialPose {
  static constexpr PoseSpace kSpace = PoseSpace::spatial;
  static constexpr std::string_view kName = "spatial";
  static constexpr int kPosition = 3;
  static constexpr int kCoordinates = 7;
  static constexpr int kDof = 6;
  static SpatialPose constant(const T* row) { return {{row[0], row[1], row[2]}, turned_by(row)}; }

  // To first order exp([w]) R = R + [w] R, which is all that a derivative at w = 0 needs.
  template <typename S>
  static SpatialPose variable(const S* row, int first) {
    const auto turn = SpatialPose<S>::turned_by(row);
    SpatialPose pose;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      const std::size_t k = (i + 2) % 3;
      pose.position[i] = T(row[i], first + static_cast<int>(i));
      for (std::size_t column = 0; column < 3; ++column) {
        T& element = pose.rotation[i][column];
        element = T(turn[i][column]);
        const auto axis = static_cast<std::size_t>(first) + 3;
        element.v[axis + j] = turn[k][column];
        element.v[axis + k] = -turn[j][column];
      }
    }
    return pose;
  }

  static void move(const T* step, T* row) {
    using std::sqrt;
    for (int i = 0; i < 3; ++i) {
      row[i] = row[i] + step[i];
    }
    const T angle = sqrt(step[3] * step[3] + step[4] * step[4] + step[5] * step[5]);
    T w, sine;
    Lanes<T>::cosine_sine(0.5 * angle, w, sine);
    // sin(a/2)/a by its series where the quotient loses digits.
    const T scale =
        Lanes<T>::select(angle < T(1e-6), 0.5 - angle * angle * (1.0 / 48), sine / angle);
    const T x = scale * step[3];
    const T y = scale * step[4];
    const T z = scale * step[5];
    const T turned[] = {w * row[3] + x * row[6] + y * row[5] - z * row[4],
                        w * row[4] + y * row[6] + z * row[3] - x * row[5],
                        w * row[5] + z * row[6] + x * row[4] - y * row[3],
                        w * row[6] - x * row[3] - y * row[4] - z * row[5]};
    const T length = sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                          turned[3] * turned[3]);
    for (int i = 0; i < 4; ++i) {
      row[3 + i] = turned[i] / length;
    }
  }

  std::array<T, 3> position;
  std::array<std::array<T, 3>, 3> rotation;

  // The rotation matrix of the quaternion, whatever its length.
  static std::array<std::array<T, 3>, 3> turned_by(const T* row) {
    const T &x = row[3], &y = row[4], &z = row[5], &w = row[6];
    const T two = 2.0 / (x * x + y * y + z * z + w * w);
    return {{{{1.0 - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)}},
             {{two * (x * y + w * z), 1.0 - two * (x * x + z * z), two * (y * z - w * x)}},
             {{two * (x * z - w * y), two * (y * z + w * x), 1.0 - two * (x * x + y * y)}}}};
  }
  static Eigen::Matrix3d rotation_matrix(const double* row) {
    const auto rows = SpatialPose<double>::turned_by(row);
    return Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(rows[0].data());
  }
};

}  // namespace symkin
