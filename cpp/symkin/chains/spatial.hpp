// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <utility>

#include "symkin/chains/planar.hpp"

// Geometry that the spatial leg structs share, for any scalars as in planar.hpp, and the two
// platforms that they carry. rho = (cos, sin, 0) and tau = (-sin, cos, 0) are those of an azimuth,
// z = (0, 0, 1).
namespace symkin {

template <typename T>
struct Vec3 {
  T x, y, z;
};
template <typename T>
Vec3(T, T, T) -> Vec3<T>;

template <typename A, typename B>
auto operator+(const Vec3<A>& a, const Vec3<B>& b) {
  return Vec3{a.x + b.x, a.y + b.y, a.z + b.z};
}

template <typename A, typename B>
auto operator-(const Vec3<A>& a, const Vec3<B>& b) {
  return Vec3{a.x - b.x, a.y - b.y, a.z - b.z};
}

template <typename S, typename T>
auto operator*(const S& s, const Vec3<T>& a) {
  return Vec3{s * a.x, s * a.y, s * a.z};
}

template <typename A, typename B>
auto dot(const Vec3<A>& a, const Vec3<B>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <typename A, typename B>
auto cross(const Vec3<A>& a, const Vec3<B>& b) {
  return Vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <typename T>
T norm(const Vec3<T>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

// A point by its distance from the origin, its polar angle from Z and its azimuth, or by its
// distance from the Z axis, its azimuth and its height: radius rho + height z.
template <typename T>
Vec3<T> point_at(const T& radius, const Azimuth<T>& polar_angle, const Azimuth<T>& azimuth) {
  const T horizontal = radius * polar_angle.sine;
  return {horizontal * azimuth.cosine, horizontal * azimuth.sine, radius * polar_angle.cosine};
}

template <typename T>
Vec3<T> point_at(const T& radius, const Azimuth<T>& azimuth, const T& height) {
  return {radius * azimuth.cosine, radius * azimuth.sine, height};
}

// x rho + y tau + z z.
template <typename T>
Vec3<T> turned(const Azimuth<T>& azimuth, const T& x, const T& y, const T& z) {
  return {azimuth.cosine * x - azimuth.sine * y, azimuth.sine * x + azimuth.cosine * y, z};
}

// e = cos s (cos eps rho + sin eps z) + sin s tau: eps = 0 is radial, 90 degrees vertical.
template <typename T>
Vec3<T> guide_direction(const Azimuth<T>& azimuth, const Azimuth<T>& elevation,
                        const Azimuth<T>& swing) {
  return turned(azimuth, swing.cosine * elevation.cosine, swing.sine,
                swing.cosine * elevation.sine);
}

// a = cos s (cos eps tau + sin eps z) + sin s rho: eps = 0 is tangential, 90 degrees vertical.
template <typename T>
Vec3<T> axis_direction(const Azimuth<T>& azimuth, const Azimuth<T>& elevation,
                       const Azimuth<T>& swing) {
  return turned(azimuth, swing.sine, swing.cosine * elevation.cosine,
                swing.cosine * elevation.sine);
}

// The axis a of a crank, the direction p0 = da/ds that its angle counts from and n = a x p0. At
// eps = s = 0 a positive angle turns the crank down.
template <typename T>
struct CrankFrame {
  CrankFrame(const Azimuth<T>& azimuth, const Azimuth<T>& elevation, const Azimuth<T>& swing)
      : axis(axis_direction(azimuth, elevation, swing)),
        zero(turned(azimuth, swing.cosine, -swing.sine * elevation.cosine,
                    -swing.sine * elevation.sine)),
        across(turned(azimuth, T(0.0), elevation.sine, -elevation.cosine)) {}

  Vec3<T> axis, zero, across;
};

namespace detail {

template <typename Tuple, std::size_t... kIndices>
auto first_references(const Tuple& all, std::index_sequence<kIndices...> /*indices*/) {
  return std::tuple<const std::tuple_element_t<kIndices, Tuple>&...>(std::get<kIndices>(all)...);
}

}  // namespace detail

template <typename T>
Vec3<T> position(const std::array<T, 3>& xyz) {
  return {xyz[0], xyz[1], xyz[2]};
}

template <typename A, typename B>
auto operator*(const Turn<A>& turn, const Vec3<B>& a) {
  const auto along = [&](const std::array<A, 3>& row) {
    return row[0] * a.x + row[1] * a.y + row[2] * a.z;
  };
  return Vec3{along(turn[0]), along(turn[1]), along(turn[2])};
}

// Closures of several kinds of scalars, such as a constant beside a jet, as an array.
template <typename H, typename... Others>
std::array<H, 1 + sizeof...(Others)> closures(const H& first, const Others&... others) {
  return {{first, H(others)...}};
}

// Points as a drawing takes them.
template <typename... Points>
std::array<Eigen::Vector3d, sizeof...(Points)> centres_in_space(const Points&... points) {
  return {Eigen::Vector3d(points.x, points.y, points.z)...};
}

// A leg's design is what it is whatever it carries: a function of its own parameters and of
// w = r + R b - A, from its base point A to the platform point b. It has
//   ForTranslating, ForRigid        the LegGeometry of its own parameters, and with b's behind them
//                                   (the first only if it can carry a translating platform)
//   base_point(own)                 A
//   closure(own, w, q), root(own, w, mode), reach_margin(own, w), joint_centres(own, w, q)
// with `own` the tuple of its own parameters, and the constants of a leg struct.

// The leg on a rigid platform.
template <typename Design>
struct OnRigid : Design, Design::ForRigid {
  template <typename T>
  using Pose = SpatialPose<T>;
  template <typename T>
  using Geometry = typename Design::ForRigid::template Geometry<T>;

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    return Design::closure(own(geometry), leg_vector<G>(geometry, pose), q);
  }

  template <typename T>
  static auto root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    return Design::root(own(geometry), leg_vector<T>(geometry, pose), mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return Design::reach_margin(own(geometry), leg_vector<T>(geometry, pose));
  }

  template <typename Q>
  static auto joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                            const Q& q) {
    return Design::joint_centres(own(geometry), leg_vector<double>(geometry, pose), q);
  }

 private:
  static constexpr std::size_t kOwn = Design::ForRigid::kGeometry - 3;

  template <typename Tuple>
  static auto own(const Tuple& geometry) {
    return detail::first_references(geometry, std::make_index_sequence<kOwn>());
  }

  template <typename G, typename T>
  static auto leg_vector(const Geometry<G>& geometry, const Pose<T>& pose) {
    const Vec3<G> b = point_at(std::get<kOwn>(geometry), std::get<kOwn + 1>(geometry),
                               std::get<kOwn + 2>(geometry));
    return position(pose.position) - Design::base_point(own(geometry)) + pose.rotation * b;
  }
};

// On a platform that never turns, R = I: its point is folded into A, so that a radius is that of
// the base less the platform's.
template <typename Design>
struct OnTranslating : Design, Design::ForTranslating {
  template <typename T>
  using Pose = TranslatingPose<T>;
  template <typename T>
  using Geometry = typename Design::ForTranslating::template Geometry<T>;

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    return Design::closure(geometry, leg_vector<G>(geometry, pose), q);
  }

  template <typename T>
  static auto root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    return Design::root(geometry, leg_vector<T>(geometry, pose), mode);
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& geometry, const Pose<T>& pose) {
    return Design::reach_margin(geometry, leg_vector<T>(geometry, pose));
  }

  template <typename Q>
  static auto joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                            const Q& q) {
    return Design::joint_centres(geometry, leg_vector<double>(geometry, pose), q);
  }

 private:
  template <typename G, typename T>
  static auto leg_vector(const Geometry<G>& geometry, const Pose<T>& pose) {
    return position(pose.position) - Design::base_point(geometry);
  }
};

// The chains of a design, on either platform.
template <typename Design>
using SpatialChains = ChainList<OnRigid<Design>, OnTranslating<Design>>;

}  // namespace symkin
