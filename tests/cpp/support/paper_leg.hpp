// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "symkin/random.hpp"
#include "symkin/types.hpp"

namespace symkin::testing {

// Rows dg/dparam of one [R]RR leg of a 3-RRR mechanism with bases 6 m and a platform of 1.5 m a
// side and links of 1.5 m, at random poses from which every leg reaches. Self-contained, so that
// the selection is tested and timed without the kinematics.
struct PaperLeg {
  double proximal_length = 1.5, distal_length = 1.5;
  double base_radius = 6 / std::sqrt(3.0), base_angle = 210 * kDegree;
  double platform_radius = 1.5 / std::sqrt(3.0), platform_angle = 210 * kDegree;
  double sensor_gain = 1, sensor_offset = 30 * kDegree;

  static constexpr double kDegree = 3.14159265358979323846 / 180;
  static constexpr Index kParameters = 8;

  // Distances of a pose (x, y, phi) from stretch and fold.
  double reach_margin(const double* pose) const {
    const double length = std::hypot(offset(pose)[0], offset(pose)[1]);
    return std::min(proximal_length + distal_length - length,
                    length - std::abs(proximal_length - distal_length));
  }

  // d = b - A.
  std::array<double, 2> offset(const double* pose) const {
    return {pose[0] + platform_radius * std::cos(pose[2] + platform_angle) -
                base_radius * std::cos(base_angle),
            pose[1] + platform_radius * std::sin(pose[2] + platform_angle) -
                base_radius * std::sin(base_angle)};
  }

  // With h = |d - l u(q)| - L = 0 and the distal unit vector w = (d - l u(q)) / L: the row is
  // -(dh/dparam) / (dh/dpsi), parameters l L OA beta ob beta_b k gamma; dg/dpose likewise.
  void row(const double* pose, double* row, double* by_pose = nullptr) const {
    const double cb = std::cos(base_angle), sb = std::sin(base_angle);
    const double cp = std::cos(pose[2] + platform_angle), sp = std::sin(pose[2] + platform_angle);
    const double dx = pose[0] + platform_radius * cp - base_radius * cb;
    const double dy = pose[1] + platform_radius * sp - base_radius * sb;
    const double square = dx * dx + dy * dy;
    const double l = proximal_length;
    const double length = std::sqrt(square);
    const double c = (l * l + square - distal_length * distal_length) / (2 * l * length);
    const double s = std::sqrt(1 - c * c);
    const double ux = (c * dx - s * dy) / length;  // u(q), q = angle(d) + acos(c): mode -1
    const double uy = (s * dx + c * dy) / length;
    const double wx = (dx - l * ux) / distal_length;
    const double wy = (dy - l * uy) / distal_length;
    const double by_q = -l * (-wx * uy + wy * ux);
    const double scale = -1 / (by_q * sensor_gain);
    row[0] = -(wx * ux + wy * uy) * scale;
    row[1] = -scale;
    row[2] = -(wx * cb + wy * sb) * scale;
    row[3] = -base_radius * (-wx * sb + wy * cb) * scale;
    row[4] = (wx * cp + wy * sp) * scale;
    row[5] = platform_radius * (-wx * sp + wy * cp) * scale;
    // The reading, one turn about the leg's direction to the centre.
    const double co = std::cos(sensor_offset), so = std::sin(sensor_offset);
    const double reading = std::atan2(co * uy - so * ux, co * ux + so * uy) / sensor_gain;
    row[6] = -reading / sensor_gain;
    row[7] = -1 / sensor_gain;
    if (by_pose != nullptr) {
      by_pose[0] = wx * scale;
      by_pose[1] = wy * scale;
      by_pose[2] = row[5];
    }
  }

  PaperLeg turned(int m) const {
    PaperLeg leg = *this;
    leg.base_angle += m * 120 * kDegree;
    leg.platform_angle += m * 120 * kDegree;
    leg.sensor_offset += m * 120 * kDegree;
    return leg;
  }
};

inline bool well_conditioned(const double* pose) {
  constexpr double kReachMargin = 0.05;
  constexpr double kConditionLimit = 20;
  Eigen::Matrix3d jacobian;
  for (int m = 0; m < 3; ++m) {
    const PaperLeg leg = PaperLeg().turned(m);
    if (leg.reach_margin(pose) < kReachMargin) {
      return false;
    }
    double row[PaperLeg::kParameters], by_pose[3];
    leg.row(pose, row, by_pose);
    jacobian.row(m) = Eigen::Map<const Eigen::RowVector3d>(by_pose);
  }
  // ||J||_F ||adj J||_F / |det J| >= cond: the Frobenius condition number would be stricter, so the
  // singular values decide.
  const Eigen::Matrix3d gram = jacobian.transpose() * jacobian;
  const double mean = gram.trace() / 3;
  const Eigen::Matrix3d deviation = gram - mean * Eigen::Matrix3d::Identity();
  const double spread = std::sqrt(deviation.squaredNorm() / 6);
  const double determinant = (deviation / spread).eval().determinant() / 2;
  const double angle = std::acos(std::max(-1.0, std::min(1.0, determinant))) / 3;
  const double largest = mean + 2 * spread * std::cos(angle);
  const double smallest = mean + 2 * spread * std::cos(angle + 120 * PaperLeg::kDegree);
  return smallest > 0 && largest < kConditionLimit * kConditionLimit * smallest;
}

// Poses (x, y, phi) uniform in a box, in the singularity-free region of the centre.
inline RowMatrix paper_poses(Index count, std::uint64_t seed = 1) {
  Random random(seed);
  RowMatrix poses(count, 3);
  for (Index i = 0; i < count;) {
    double* pose = poses.row(i).data();
    pose[0] = 4 * random.uniform() - 2;
    pose[1] = 4 * random.uniform() - 2;
    pose[2] = 3 * random.uniform() - 1.5;
    i += well_conditioned(pose) ? 1 : 0;
  }
  return poses;
}

inline RowMatrix paper_rows(const RowMatrix& poses, int leg = 0) {
  RowMatrix rows(poses.rows(), PaperLeg::kParameters);
  const PaperLeg turned = PaperLeg().turned(leg);
  for (Index i = 0; i < poses.rows(); ++i) {
    turned.row(poses.row(i).data(), rows.row(i).data());
  }
  return rows;
}

}  // namespace symkin::testing
