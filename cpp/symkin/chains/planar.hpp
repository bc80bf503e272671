// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "symkin/model/leg_geometry.hpp"
#include "symkin/model/parameters.hpp"
#include "symkin/model/pose.hpp"

// Plane geometry that the planar leg structs share, for any scalars: numbers, batches of numbers
// and jets, also mixed, since a product with a constant costs much less than one of two jets.
namespace symkin {

template <typename T>
struct Vec2 {
  T x, y;
};
template <typename T>
Vec2(T, T) -> Vec2<T>;

template <typename A, typename B>
auto operator+(const Vec2<A>& a, const Vec2<B>& b) {
  return Vec2{a.x + b.x, a.y + b.y};
}

template <typename A, typename B>
auto operator-(const Vec2<A>& a, const Vec2<B>& b) {
  return Vec2{a.x - b.x, a.y - b.y};
}

template <typename T>
Vec2<T> operator-(const Vec2<T>& a) {
  return {-a.x, -a.y};
}

template <typename S, typename T>
auto operator*(const S& s, const Vec2<T>& a) {
  return Vec2{s * a.x, s * a.y};
}

template <typename A, typename B>
auto dot(const Vec2<A>& a, const Vec2<B>& b) {
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

template <typename R, typename T>
auto polar(const R& radius, const Azimuth<T>& azimuth) {
  return radius * direction(azimuth);
}

template <typename T>
Azimuth<T> azimuth(const Vec2<T>& a) {
  const T inverse = 1.0 / norm(a);
  return {inverse * a.x, inverse * a.y};
}

template <typename T>
Vec2<T> position(const PlanarPose<T>& pose) {
  return {pose.x, pose.y};
}

// Platform point b in the base frame: r + ob u(phi + beta_b).
template <typename T, typename R, typename A>
auto platform_point(const PlanarPose<T>& pose, const R& platform_radius,
                    const Azimuth<A>& platform_angle) {
  return position(pose) + polar(platform_radius, pose.phi + platform_angle);
}

// d = b - A, from the base point to the platform point, in the base frame.
template <typename T, typename G>
auto leg_vector(const PlanarPose<T>& pose, const G& base_radius, const Azimuth<G>& base_angle,
                const G& platform_radius, const Azimuth<G>& platform_angle) {
  return platform_point(pose, platform_radius, platform_angle) - polar(base_radius, base_angle);
}

// Signed distance of a point of the base frame from a guide on the base, u(beta) . p - OA.
template <typename T, typename R, typename A>
auto beyond_base_guide(const Vec2<T>& point, const R& base_radius, const Azimuth<A>& base_angle) {
  return dot(direction(base_angle), point) - base_radius;
}

// Signed distance of a point of the base frame from a guide on the platform,
// u(phi + beta_b) . (p - r) - ob.
template <typename P, typename T, typename R, typename A>
auto beyond_platform_guide(const Vec2<P>& point, const PlanarPose<T>& pose,
                           const R& platform_radius, const Azimuth<A>& platform_angle) {
  return dot(direction(pose.phi + platform_angle), point - position(pose)) - platform_radius;
}

// Cosine of the angle between the sides `a` and `b` of a triangle whose third side is `c`.
template <typename T>
T triangle_cosine(const T& a, const T& b, const T& c) {
  return (a * a + b * b - c * c) / (2.0 * a * b);
}

// The angle between 0 and pi of that cosine, times the sign; NaN if there is none.
template <typename T>
Azimuth<T> arc_cosine(const T& cosine, const T& sign) {
  using std::sqrt;
  return {cosine, sign * sqrt((1.0 - cosine) * (1.0 + cosine))};
}

// Side of a right-angled triangle beside the side `across`; NaN if that is longer than the
// hypotenuse.
template <typename T>
T triangle_leg(const T& hypotenuse, const T& across) {
  using std::sqrt;
  return sqrt((hypotenuse - across) * (hypotenuse + across));
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
template <typename T>
T dyad_margin(const T& proximal, const T& distal, const T& distance) {
  using std::abs;
  using std::min;
  return min(proximal + distal - distance, distance - abs(proximal - distal));
}

// What the planar leg structs share: their pose, and the parameters of their geometry.
template <const ParameterInfo&... kInfos>
struct PlanarLeg : LegGeometry<kInfos...> {
  template <typename T>
  using Pose = PlanarPose<T>;
  using JointCentres = std::array<Eigen::Vector2d, 3>;  // base to platform
};

}  // namespace symkin
