// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "symkin/model/jet.hpp"

namespace symkin::factors {

// What was observed of a pose beside the readings. A kind of observation is one struct:
//   kRows                     rows that it brings, 1 or 3
//   kOwn                      how many scalars it has of its own, 4 at most
//   kValues                   measured values that it takes (of an orientation: its matrix by rows)
//   misfit(scene, own, m)     kRows misfits, true less measured, at the measured values m
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

// Directions: the pose's six, the kind's own four, the base's and the target's six. Those behind a
// jet's last are held.
inline constexpr int kPose = 0, kOwn = 6, kBase = 10, kTarget = 16, kDirections = 22;

template <typename T, typename S = typename T::Scalar>
T variable(const S& value, int direction) {
  return direction < T::DIMENSION ? T(value, direction) : T(value);
}

template <typename T, typename S = typename T::Scalar>
Vec3<T> variable_position(const S* position, int first) {
  return {variable<T>(position[0], first), variable<T>(position[1], first + 1),
          variable<T>(position[2], first + 2)};
}

// exp([w]) R = R + [w] R to first order, at w = 0; the matrix by rows.
template <typename T, typename S = typename T::Scalar>
Mat3<T> variable_rotation(const S* rows, int first) {
  Mat3<T> variable;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    for (int column = 0; column < 3; ++column) {
      T value(rows[3 * i + column]);
      if (first < T::DIMENSION) {
        value.v[first + j] = rows[3 * k + column];
        value.v[first + k] = -rows[3 * j + column];
      }
      variable[static_cast<std::size_t>(i)][static_cast<std::size_t>(column)] = value;
    }
  }
  return variable;
}

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
Mat3<T> times_transposed(const Mat3<T>& a, const typename T::Scalar* rows) {
  Mat3<T> product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product[i][j] = a[i][0] * rows[3 * j] + a[i][1] * rows[3 * j + 1] + a[i][2] * rows[3 * j + 2];
    }
  }
  return product;
}

// angle / sin(angle) of angles up to half a turn, a lane at a time.
template <typename S>
S angle_by_sine(const S& sine, const S& cosine) {
  constexpr int kCount = Lanes<S>::kCount;
  Index lanes[kCount];
  double sines[kCount], cosines[kCount];
  for (int lane = 0; lane < kCount; ++lane) {
    lanes[lane] = lane;
  }
  Lanes<S>::scatter(sine, sines, lanes);
  Lanes<S>::scatter(cosine, cosines, lanes);
  for (int lane = 0; lane < kCount; ++lane) {
    sines[lane] = std::atan2(sines[lane], cosines[lane]) / sines[lane];
  }
  return Lanes<S>::gather(sines, lanes);
}

// The rotation vector of a rotation matrix less than half a turn away from none. Exact to first
// order at none, where the general formula is 0 / 0.
template <typename T, typename S = typename T::Scalar>
Vec3<T> rotation_vector(const Mat3<T>& r) {
  using std::sqrt;
  // Twice the quaternion's vector part times its scalar part, and the angle from both.
  const Vec3<T> axis{0.5 * (r[2][1] - r[1][2]), 0.5 * (r[0][2] - r[2][0]),
                     0.5 * (r[1][0] - r[0][1])};
  const T cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
  const T square = dot(axis, axis);
  // angle / sin(angle) as a function of the square of the sine, on either side of a quarter turn.
  T factor = 1.0 + square * (1.0 / 6 + square * (3.0 / 40 + square * (15.0 / 336)));
  const S far = Lanes<S>::select(cosine.a > S(0.0), square.a, S(1.0));
  const auto is_far = far >= S(1e-4);
  if (Lanes<S>::any(is_far)) {
    const S sine = sqrt(square.a);
    const S value = angle_by_sine(sine, cosine.a);
    // d angle = cos d(sin) - sin d(cos)
    const S by_square = (cosine.a - value) / (2.0 * square.a);
    factor.a = Lanes<S>::select(is_far, value, factor.a);
    for (int i = 0; i < T::DIMENSION; ++i) {
      factor.v[i] = Lanes<S>::select(is_far, by_square * square.v[i] - cosine.v[i], factor.v[i]);
    }
  }
  return {factor * axis[0], factor * axis[1], factor * axis[2]};
}

// The angle of (cosine, sine) less `measured`, by the shorter way round, a lane at a time.
inline constexpr double kFullTurn = 6.283185307179586;
template <typename T, typename S = typename T::Scalar>
T turned_beyond(const T& sine, const T& cosine, const S& measured, double turn = kFullTurn) {
  constexpr int kCount = Lanes<S>::kCount;
  Index lanes[kCount];
  double angles[kCount], cosines[kCount], from[kCount];
  for (int lane = 0; lane < kCount; ++lane) {
    lanes[lane] = lane;
  }
  Lanes<S>::scatter(sine.a, angles, lanes);
  Lanes<S>::scatter(cosine.a, cosines, lanes);
  Lanes<S>::scatter(measured, from, lanes);
  for (int lane = 0; lane < kCount; ++lane) {
    angles[lane] = std::remainder(std::atan2(angles[lane], cosines[lane]) - from[lane], turn);
  }
  T beyond(Lanes<S>::gather(angles, lanes));
  const S square = sine.a * sine.a + cosine.a * cosine.a;
  for (int i = 0; i < T::DIMENSION; ++i) {
    beyond.v[i] = (cosine.a * sine.v[i] - sine.a * cosine.v[i]) / square;
  }
  return beyond;
}

// b + R_B (r + R p), a point p of the platform in the device's frame.
template <typename T>
Vec3<T> seen(const Scene<T>& scene, const Vec3<T>& point) {
  return scene.base_position + scene.base_rotation * (scene.position + scene.rotation * point);
}

struct MeasuredPosition {
  static constexpr int kRows = 3, kValues = 3;
  static constexpr int kOwn = 0;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                        const typename T::Scalar* measured) {
    return seen(scene, scene.target_position) -
           Vec3<typename T::Scalar>{measured[0], measured[1], measured[2]};
  }
};

struct MeasuredOrientation {
  static constexpr int kRows = 3, kValues = 9;
  static constexpr int kOwn = 0;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                        const typename T::Scalar* measured) {
    return rotation_vector(
        times_transposed(scene.base_rotation * (scene.rotation * scene.target_rotation), measured));
  }
};

struct ReportedPosition {
  static constexpr int kRows = 3, kValues = 3;
  static constexpr int kOwn = 0;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                        const typename T::Scalar* measured) {
    return scene.position - Vec3<typename T::Scalar>{measured[0], measured[1], measured[2]};
  }
};

struct ReportedOrientation {
  static constexpr int kRows = 3, kValues = 9;
  static constexpr int kOwn = 0;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                        const typename T::Scalar* measured) {
    return rotation_vector(times_transposed(scene.rotation, measured));
  }
};

struct TargetPoint {  // own: the point in the platform's frame
  static constexpr int kRows = 3, kValues = 3;
  static constexpr int kOwn = 3;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const Vec3<T>& own,
                        const typename T::Scalar* measured) {
    return seen(scene, own) - Vec3<typename T::Scalar>{measured[0], measured[1], measured[2]};
  }
};

struct Distance {  // own: the fixed point in the device's frame
  static constexpr int kRows = 1, kValues = 1;
  static constexpr int kOwn = 3;
  template <typename T>
  static std::array<T, 1> misfit(const Scene<T>& scene, const Vec3<T>& own,
                                 const typename T::Scalar* measured) {
    const Vec3<T> way = seen(scene, scene.target_position) - own;
    return {sqrt(dot(way, way)) - measured[0]};
  }
};

// own: the bed, c0, c1, c2 and its bow; beside the height 1 / the square of its radius is measured.
struct Height {
  static constexpr int kRows = 1, kValues = 2;
  static constexpr int kOwn = 4;
  template <typename T>
  static std::array<T, 1> misfit(const Scene<T>& scene, const std::array<T, 4>& own,
                                 const typename T::Scalar* measured) {
    const Vec3<T> target = scene.position + scene.rotation * scene.target_position;
    const T bowed = own[3] * (target[0] * target[0] + target[1] * target[1]) * measured[1];
    const T above = target[2] - own[0] - own[1] * target[0] - own[2] * target[1] - bowed;
    return {above / sqrt(1.0 + own[1] * own[1] + own[2] * own[2]) - measured[0]};
  }
};

// Roll, pitch and yaw of the target in the device's frame, M = Rz(yaw) Ry(pitch) Rx(roll), each a
// row of its own, as an attitude sensor shows them away from pitches of a quarter turn: roll and
// pitch do not depend on the yaw, which may be missing.
struct Attitude {
  static constexpr int kRows = 3, kValues = 3;
  static constexpr int kOwn = 0;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                        const typename T::Scalar* measured) {
    const Mat3<T> m = scene.base_rotation * (scene.rotation * scene.target_rotation);
    return {turned_beyond(m[2][1], m[2][2], measured[0]),
            turned_beyond(-m[2][0], sqrt(m[2][1] * m[2][1] + m[2][2] * m[2][2]), measured[1]),
            turned_beyond(m[1][0], m[0][0], measured[2])};
  }
};

// The angle about a known axis a of the device's frame that is in M, the swing to it left out:
// 2 atan2(2 a.v, 1 + trace M), v = vee((M - M')/2). Measured are the angle and the axis.
struct Turn {
  static constexpr int kRows = 1, kValues = 4;
  static constexpr int kOwn = 0;
  template <typename T>
  static std::array<T, 1> misfit(const Scene<T>& scene, const std::array<T, 0>& /*own*/,
                                 const typename T::Scalar* measured) {
    const Mat3<T> m = scene.base_rotation * (scene.rotation * scene.target_rotation);
    const Vec3<T> twice{m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
    const T along = dot(twice, Vec3<typename T::Scalar>{measured[1], measured[2], measured[3]});
    const T half =
        turned_beyond(along, 1.0 + m[0][0] + m[1][1] + m[2][2], 0.5 * measured[0], 0.5 * kFullTurn);
    return {2.0 * half};
  }
};

// What of three components is along the axes in which their errors are independent: behind the
// measured ones these, by rows.
template <typename Of>
struct Along {
  static constexpr int kRows = 3, kValues = 12;
  static constexpr int kOwn = Of::kOwn;
  template <typename T>
  static Vec3<T> misfit(const Scene<T>& scene,
                        const std::array<T, static_cast<std::size_t>(kOwn)>& own,
                        const typename T::Scalar* measured) {
    using S = typename T::Scalar;
    const Vec3<T> off = Of::misfit(scene, own, measured);
    Vec3<T> along;
    for (std::size_t i = 0; i < 3; ++i) {
      const S* const axis = measured + 3 + 3 * i;
      along[i] = dot(off, Vec3<S>{axis[0], axis[1], axis[2]});
    }
    return along;
  }
};

}  // namespace symkin::factors
