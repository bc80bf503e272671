// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "symkin/model/azimuth.hpp"
#include "symkin/model/jet.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// The pose as the closures see it. `constant` reads coordinates as they are; `variable` makes the
// tangent the derivative directions `first`, `first + 1`, ... of the jet T; `move` takes a step on
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

// Position in space and a turn about Z (H4).
template <typename T>
struct SchoenfliesPose {
  static constexpr PoseSpace kSpace = PoseSpace::schoenflies;
  static constexpr std::string_view kName = "schoenflies";
  static constexpr int kPosition = 3;
  static constexpr int kCoordinates = 4;
  static constexpr int kDof = 4;
  static SchoenfliesPose constant(const T* row) {
    return {{row[0], row[1], row[2]}, Azimuth<T>(row[3])};
  }
  template <typename S>
  static SchoenfliesPose variable(const S* row, int first) {
    return {{T(row[0], first), T(row[1], first + 1), T(row[2], first + 2)},
            Azimuth<T>(T(row[3], first + 3))};
  }
  static void move(const T* step, T* row) {
    for (int i = 0; i < kDof; ++i) {
      row[i] = row[i] + step[i];
    }
  }

  std::array<T, 3> position;
  Azimuth<T> theta;
};

// Rotation matrices by rows, of unit quaternions (x, y, z, w).
template <typename T>
using Turn = std::array<std::array<T, 3>, 3>;

// The rotation matrix of the quaternion, whatever its length.
template <typename T>
Turn<T> turn_of(const T* quaternion) {
  const T &x = quaternion[0], &y = quaternion[1], &z = quaternion[2], &w = quaternion[3];
  const T two = 2.0 / (x * x + y * y + z * z + w * w);
  return {{{{1.0 - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)}},
           {{two * (x * y + w * z), 1.0 - two * (x * x + z * z), two * (y * z - w * x)}},
           {{two * (x * z - w * y), two * (y * z + w * x), 1.0 - two * (x * x + y * y)}}}};
}

// To first order exp([w]) R = R + [w] R, which is all that a derivative at w = 0 needs; w are the
// directions `first`, `first + 1` and `first + 2` of the jet T.
template <typename T, typename S>
Turn<T> variable_turn(const S* quaternion, int first) {
  const Turn<S> turn = turn_of(quaternion);
  Turn<T> variable;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    for (std::size_t column = 0; column < 3; ++column) {
      T& element = variable[i][column];
      element = T(turn[i][column]);
      element.v[first + static_cast<Index>(j)] = turn[k][column];
      element.v[first + static_cast<Index>(k)] = -turn[j][column];
    }
  }
  return variable;
}

// The quaternion turned by a rotation vector.
template <typename T>
void turn_quaternion(const T* step, T* row) {
  using std::sqrt;
  const T angle = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
  T w, sine;
  Lanes<T>::cosine_sine(0.5 * angle, w, sine);
  // sin(a/2)/a by its series where the quotient loses digits.
  const T scale = Lanes<T>::select(angle < T(1e-6), 0.5 - angle * angle * (1.0 / 48), sine / angle);
  const T x = scale * step[0];
  const T y = scale * step[1];
  const T z = scale * step[2];
  const T turned[] = {w * row[0] + x * row[3] + y * row[2] - z * row[1],
                      w * row[1] + y * row[3] + z * row[0] - x * row[2],
                      w * row[2] + z * row[3] + x * row[1] - y * row[0],
                      w * row[3] - x * row[0] - y * row[1] - z * row[2]};
  const T length = sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                        turned[3] * turned[3]);
  for (int i = 0; i < 4; ++i) {
    row[i] = turned[i] / length;
  }
}

inline Eigen::Matrix3d rotation_matrix(const double* quaternion) {
  const Turn<double> rows = turn_of(quaternion);
  return Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(rows[0].data());
}

template <typename T>
struct SpatialPose {
  static constexpr PoseSpace kSpace = PoseSpace::spatial;
  static constexpr std::string_view kName = "spatial";
  static constexpr int kPosition = 3;
  static constexpr int kCoordinates = 7;
  static constexpr int kDof = 6;
  static SpatialPose constant(const T* row) { return {{row[0], row[1], row[2]}, turn_of(row + 3)}; }
  template <typename S>
  static SpatialPose variable(const S* row, int first) {
    return {{T(row[0], first), T(row[1], first + 1), T(row[2], first + 2)},
            variable_turn<T>(row + 3, first + 3)};
  }
  static void move(const T* step, T* row) {
    for (int i = 0; i < 3; ++i) {
      row[i] = row[i] + step[i];
    }
    turn_quaternion(step + 3, row + 3);
  }

  std::array<T, 3> position;
  Turn<T> rotation;
};

// Orientation alone: the platform turns about a fixed point (Agile Eye).
template <typename T>
struct SphericalPose {
  static constexpr PoseSpace kSpace = PoseSpace::spherical;
  static constexpr std::string_view kName = "spherical";
  static constexpr int kPosition = 0;
  static constexpr int kCoordinates = 4;
  static constexpr int kDof = 3;
  static SphericalPose constant(const T* row) { return {turn_of(row)}; }
  template <typename S>
  static SphericalPose variable(const S* row, int first) {
    return {variable_turn<T>(row, first)};
  }
  static void move(const T* step, T* row) { turn_quaternion(step, row); }

  Turn<T> rotation;
};

}  // namespace symkin
