// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <string_view>

#include "symkin/chains/spatial.hpp"

namespace symkin {

// U[P]S pulley: a cable that comes up the vertical axis through A, runs over a pulley of radius rho
// that swivels about this axis, and leaves it for the platform point (A. Pott, Cable-Driven
// Parallel Robots, Springer 2018). q is the length of cable beyond A.
//
// The pulley turns towards the platform point, so all lies in the plane of the axis and of w: with
// h the horizontal and z the vertical part of w, A is (0, 0), the pulley's centre (rho, 0) and the
// platform point (h, z). The free part of the cable is the tangent
//   t = sqrt((h - rho)^2 + z^2 - rho^2) = sqrt(|w|^2 - 2 rho h).
// It leaves the pulley in the direction s from its centre: that of the platform point,
// atan2(z, h - rho), and atan2(t, rho) on. A itself is in the direction pi. Closure (m):
//   rho (pi - s) + t - q,    s = atan2((h - rho) t + rho z, (h - rho) rho - z t).
// A cable is out of reach inside of the pulley. Straight below A the direction to swivel to is not
// defined; above, cable and axis are one and the closure is smooth. With rho = 0 it is U[P]S.
struct UpsPulley {
  using ForTranslating = LegGeometry<kPulleyRadius, kBaseRadius, kBasePolarAngle, kBaseAzimuth>;
  using ForRigid = LegGeometry<kPulleyRadius, kBaseRadius, kBasePolarAngle, kBaseAzimuth,
                               kPlatformRadius, kPlatformPolarAngle, kPlatformAzimuth>;
  static constexpr std::string_view kName = "U[P]S pulley";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::distance;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning: the length is the only root";

  template <typename Own>
  static auto base_point(const Own& own) {
    const auto& [rho, OA, alpha, beta] = own;
    return point_at(OA, alpha, beta);
  }

  template <typename Own, typename W, typename Q>
  static auto closure(const Own& own, const Vec3<W>& w, const Q& q) {
    return length(own, w) - q;
  }

  template <typename Own, typename T>
  static T root(const Own& own, const Vec3<T>& w, const T& /*mode*/) {
    return length(own, w);
  }

  // From the platform point to the pulley, which fills a ring about the axis.
  template <typename Own, typename T>
  static T reach_margin(const Own& own, const Vec3<T>& w) {
    using std::sqrt;
    const auto& [rho, OA, alpha, beta] = own;
    const T beyond = horizontal(w) - rho;
    return sqrt(beyond * beyond + w.z * w.z) - rho;
  }

  // A, where the cable leaves the pulley, and the platform point.
  template <typename Own>
  static auto joint_centres(const Own& own, const Vec3<double>& w, double /*q*/) {
    const auto& [rho, OA, alpha, beta] = own;
    const double h = horizontal(w);
    const double s = departure(rho, w, h, tangent(rho, w, h));
    const double out = rho * (1 + std::cos(s)) / h;
    const Vec3<double> base = base_point(own);
    return centres_in_space(base, base + Vec3{out * w.x, out * w.y, rho * std::sin(s)}, base + w);
  }

 private:
  // On the axis, where its derivative would be 0 / 0, it is a picometre.
  template <typename W>
  static W horizontal(const Vec3<W>& w) {
    using std::sqrt;
    constexpr double kOnAxis = 1e-24;
    return sqrt(w.x * w.x + w.y * w.y + kOnAxis);
  }

  template <typename R, typename W>
  static auto tangent(const R& rho, const Vec3<W>& w, const W& h) {
    using std::sqrt;
    const auto shorter = rho * h;
    return sqrt(dot(w, w) - shorter - shorter);
  }

  // The direction s from the pulley's centre in which the cable leaves it.
  template <typename R, typename W, typename T>
  static auto departure(const R& rho, const Vec3<W>& w, const W& h, const T& t) {
    using std::atan2;
    const auto beyond = h - rho;
    return atan2(beyond * t + rho * w.z, beyond * rho - w.z * t);
  }

  template <typename Own, typename W>
  static auto length(const Own& own, const Vec3<W>& w) {
    const auto& [rho, OA, alpha, beta] = own;
    const W h = horizontal(w);
    const auto t = tangent(rho, w, h);
    return rho * (kPi - departure(rho, w, h, t)) + t;
  }
};

using PulleyChains = SpatialChains<UpsPulley>;

}  // namespace symkin
