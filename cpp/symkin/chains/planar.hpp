// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "symkin/model/leg_geometry.hpp"
#include "symkin/model/parameters.hpp"
#include "symkin/model/pose.hpp"

// Plane geometry that the planar leg structs share, for any scalar (double or autodiff).
namespace symkin {

template <typename T>
struct Vec2 {
  T x, y;

  friend Vec2 operator+(const Vec2& a, const Vec2& b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2 operator-(const Vec2& a, const Vec2& b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2 operator*(const T& s, const Vec2& a) { return {s * a.x, s * a.y}; }
};

template <typename T>
T dot(const Vec2<T>& a, const Vec2<T>& b) {
  return a.x * b.x + a.y * b.y;
}

template <typename T>
T norm(const Vec2<T>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

// u(azimuth), n(azimuth) = u(azimuth + pi/2) and radius u(azimuth).
template <typename T>
Vec2<T> direction(const Azimuth<T>& azimuth) {
  return {azimuth.cosine, azimuth.sine};
}

template <typename T>
Vec2<T> normal(const Azimuth<T>& azimuth) {
  return {-azimuth.sine, azimuth.cosine};
}

template <typename T>
Vec2<T> polar(const T& radius, const Azimuth<T>& azimuth) {
  return radius * direction(azimuth);
}

// The same for an angle that is met once, such as the active joint's.
template <typename T>
Vec2<T> direction(const T& angle) {
  return direction(Azimuth<T>(angle));
}

template <typename T>
Vec2<T> normal(const T& angle) {
  return normal(Azimuth<T>(angle));
}

template <typename T>
Vec2<T> polar(const T& radius, const T& angle) {
  return radius * direction(angle);
}

inline double angle(const Vec2<double>& a) { return std::atan2(a.y, a.x); }

template <typename T>
Vec2<T> position(const PlanarPose<T>& pose) {
  return {pose.x, pose.y};
}

// Platform point b in the base frame: r + ob u(phi + beta_b).
template <typename T>
Vec2<T> platform_point(const PlanarPose<T>& pose, const T& platform_radius,
                       const Azimuth<T>& platform_angle) {
  return position(pose) + polar(platform_radius, pose.phi + platform_angle);
}

// d = b - A, from the base point to the platform point, in the base frame.
template <typename T>
Vec2<T> leg_vector(const PlanarPose<T>& pose, const T& base_radius, const Azimuth<T>& base_angle,
                   const T& platform_radius, const Azimuth<T>& platform_angle) {
  return platform_point(pose, platform_radius, platform_angle) - polar(base_radius, base_angle);
}

// Signed distance of a point of the base frame from a guide on the base, u(beta) . p - OA.
template <typename T>
T beyond_base_guide(const Vec2<T>& point, const T& base_radius, const Azimuth<T>& base_angle) {
  return dot(direction(base_angle), point) - base_radius;
}

// Signed distance of a point of the base frame from a guide on the platform,
// u(phi + beta_b) . (p - r) - ob.
template <typename T>
T beyond_platform_guide(const Vec2<T>& point, const PlanarPose<T>& pose, const T& platform_radius,
                        const Azimuth<T>& platform_angle) {
  return dot(direction(pose.phi + platform_angle), point - position(pose)) - platform_radius;
}

// Angle between the sides `a` and `b` of a triangle whose third side is `c`; NaN if there is none.
inline double triangle_angle(double a, double b, double c) {
  return std::acos((a * a + b * b - c * c) / (2 * a * b));
}

// Side of a right-angled triangle beside the side `across`; NaN if that is longer than the
// hypotenuse.
inline double triangle_leg(double hypotenuse, double across) {
  return std::sqrt((hypotenuse - across) * (hypotenuse + across));
}

// Points as a drawing takes them.
template <typename... Points>
std::array<Eigen::Vector2d, sizeof...(Points)> centres(const Points&... points) {
  return {Eigen::Vector2d(points.x, points.y)...};
}

// A leg's reach margin is the shortest translation of the platform, at its orientation, that
// changes whether the leg can reach: positive inside, negative outside, metres.
inline constexpr double kUnlimitedReach = std::numeric_limits<double>::infinity();

// Reach of two links whose ends are `distance` apart: to the stretched or the folded dyad.
inline double dyad_margin(double proximal, double distal, double distance) {
  return std::min(proximal + distal - distance, distance - std::abs(proximal - distal));
}

// What the planar leg structs share: their pose, and the parameters of their geometry.
template <const ParameterInfo&... kInfos>
struct PlanarLeg : LegGeometry<kInfos...> {
  template <typename T>
  using Pose = PlanarPose<T>;
  using JointCentres = std::array<Eigen::Vector2d, 3>;  // base to platform
};

}  // namespace symkin
