// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "symkin/estimation/unknowns.hpp"
#include "symkin/model/jet.hpp"

namespace symkin::factors {

// What was observed of a pose beside the readings. A kind of observation is one struct:
//   kRows                     rows that it brings, 1 or 3
//   kOwn                      whether it has three scalars of its own
//   misfit(scene, own, m)     kRows misfits, true less measured, at the measured values m (of a
//                             frame: its 12, position and then the rotation's rows)
// Derivatives are by autodiff in all directions of the pose, the frames and its own scalars.

template <typename T>
using Vec3 = std::array<T, 3>;
template <typename T>
using Mat3 = std::array<Vec3<T>, 3>;

template <typename T>
struct Scene {
  Vec3<T> position;  // r and R of the platform in the base's frame
  Mat3<T> rotation;
  Vec3<T> base_position;  // b and R_B of the base in the device's frame
  Mat3<T> base_rotation;
  Vec3<T> target_position;  // t and R_T of the target in the platform's frame
  Mat3<T> target_rotation;
};

// Directions: the pose's six, the base's, the target's, the kind's own three.
inline constexpr int kDirections = 21;
using Scalar = Jet<double, kDirections>;

Scene<Scalar> scene_of(const Frame& pose, const Frame& base, const Frame& target);

template <typename T>
Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <typename T, typename U>
Vec3<T> operator-(const Vec3<T>& a, const Vec3<U>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <typename T, typename U>
T dot(const Vec3<T>& a, const Vec3<U>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <typename T>
Vec3<T> operator*(const Mat3<T>& matrix, const Vec3<T>& vector) {
  return {dot(matrix[0], vector), dot(matrix[1], vector), dot(matrix[2], vector)};
}
// A B and A B'
template <typename T>
Mat3<T> operator*(const Mat3<T>& a, const Mat3<T>& b) {
  Mat3<T> product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
    }
  }
  return product;
}
template <typename T>
Mat3<T> times_transposed(const Mat3<T>& a, const double* rows) {
  Mat3<T> product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product[i][j] = a[i][0] * rows[3 * j] + a[i][1] * rows[3 * j + 1] + a[i][2] * rows[3 * j + 2];
    }
  }
  return product;
}

// The rotation vector of a rotation matrix less than half a turn away from none. Exact to first
// order at none, where the general formula is 0 / 0.
template <typename T>
Vec3<T> rotation_vector(const Mat3<T>& r) {
  // Twice the quaternion's vector part times its scalar part, and the angle from both.
  const Vec3<T> axis{0.5 * (r[2][1] - r[1][2]), 0.5 * (r[0][2] - r[2][0]),
                     0.5 * (r[1][0] - r[0][1])};
  const T cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
  const T square = dot(axis, axis);
  const double sine = std::sqrt(square.a);
  // angle / sin(angle) as a function of the square of the sine, on either side of a quarter turn.
  T factor = cosine;
  if (square.a < 1e-6 && cosine.a > 0) {
    factor = 1.0 + square * (1.0 / 6 + square * (3.0 / 40 + square * (15.0 / 336)));
  } else {
    const double angle = std::atan2(sine, cosine.a);
    // d angle = cos d(sin) - sin d(cos)
    factor = jet_of<typename T::Scalar, T::DIMENSION>(angle / sine, [&](int i) {
      const double by_sine = square.v[i] / (2 * sine);
      const double by_angle = cosine.a * by_sine - sine * cosine.v[i];
      return (by_angle - angle / sine * by_sine) / sine;
    });
  }
  return {factor * axis[0], factor * axis[1], factor * axis[2]};
}

// b + R_B (r + R p), a point p of the platform in the device's frame.
template <typename T>
Vec3<T> seen(const Scene<T>& scene, const Vec3<T>& point) {
  return scene.base_position + scene.base_rotation * (scene.position + scene.rotation * point);
}

struct MeasuredPosition {
  static constexpr int kRows = 3;
  static constexpr bool kOwn = false;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& /*own*/, const double* measured) {
    return seen(scene, scene.target_position) - Vec3<double>{measured[0], measured[1], measured[2]};
  }
};

struct MeasuredOrientation {
  static constexpr int kRows = 3;
  static constexpr bool kOwn = false;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& /*own*/, const double* measured) {
    return rotation_vector(times_transposed(
        scene.base_rotation * (scene.rotation * scene.target_rotation), measured + 3));
  }
};

struct ReportedPosition {
  static constexpr int kRows = 3;
  static constexpr bool kOwn = false;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& /*own*/, const double* measured) {
    return scene.position - Vec3<double>{measured[0], measured[1], measured[2]};
  }
};

struct ReportedOrientation {
  static constexpr int kRows = 3;
  static constexpr bool kOwn = false;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& /*own*/, const double* measured) {
    return rotation_vector(times_transposed(scene.rotation, measured + 3));
  }
};

struct TargetPoint {  // own: the point in the platform's frame
  static constexpr int kRows = 3;
  static constexpr bool kOwn = true;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& own, const double* measured) {
    return seen(scene, own) - Vec3<double>{measured[0], measured[1], measured[2]};
  }
};

struct Distance {  // own: the fixed point in the device's frame
  static constexpr int kRows = 1;
  static constexpr bool kOwn = true;
  template <typename T>
  static std::array<T, 1> misfit(const Scene<T>& scene, const Vec3<T>& own,
                                 const double* measured) {
    const Vec3<T> way = seen(scene, scene.target_position) - own;
    return {sqrt(dot(way, way)) - measured[0]};
  }
};

struct Height {  // own: the plane, c0, c1, c2
  static constexpr int kRows = 1;
  static constexpr bool kOwn = true;
  template <typename T>
  static std::array<T, 1> misfit(const Scene<T>& scene, const Vec3<T>& own,
                                 const double* measured) {
    const Vec3<T> target = scene.position + scene.rotation * scene.target_position;
    const T above = target[2] - own[0] - own[1] * target[0] - own[2] * target[1];
    return {above / sqrt(1.0 + own[1] * own[1] + own[2] * own[2]) - measured[0]};
  }
};

}  // namespace symkin::factors
