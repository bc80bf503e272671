// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "symkin/support/random.hpp"
#include "symkin/support/types.hpp"

namespace symkin::testing {

// Rows dg/dparam of one [R]RR leg of a 3-RRR mechanism with bases 6 m and a platform of 1.5 m a
// side and links of 1.5 m, at random poses from which every leg reaches. Self-contained, so that
// the selection is tested and timed without the kinematics.
class PaperLeg {
 public:
  static constexpr double kDegree = 3.14159265358979323846 / 180;
  static constexpr Index kParameters = 8;  // l L OA beta ob beta_b k gamma

  // The leg of the mechanism that is turned about its centre by `turn` (rad).
  explicit PaperLeg(double turn = 0)
      : platform_angle_(210 * kDegree + turn),
        base_cos_(std::cos(210 * kDegree + turn)),
        base_sin_(std::sin(210 * kDegree + turn)),
        offset_cos_(std::cos(30 * kDegree + turn)),
        offset_sin_(std::sin(30 * kDegree + turn)) {}

  // Distance of a pose (x, y, phi) from stretch and fold, negative out of reach.
  double reach_margin(const double* pose) const {
    const Geometry g(*this, pose);
    const double length = std::sqrt(g.dx * g.dx + g.dy * g.dy);
    return std::min(kLink + kLink - length, length);
  }

  // With h = |d - l u(q)| - L = 0 and the distal unit vector w = (d - l u(q)) / L the row is
  // -(dh/dparam) / (dh/dpsi), and dg/dpose likewise.
  void row(const double* pose, double* row, double* by_pose = nullptr) const {
    const Geometry g(*this, pose);
    const double square = g.dx * g.dx + g.dy * g.dy;
    const double inverse_length = 1 / std::sqrt(square);
    const double c = square * inverse_length / (2 * kLink);  // the links are equal
    const double s = std::sqrt(1 - c * c);
    // u(q) with q = angle(d) + acos(c): working mode -1.
    const double ux = (c * g.dx - s * g.dy) * inverse_length;
    const double uy = (s * g.dx + c * g.dy) * inverse_length;
    const double wx = g.dx / kLink - ux;
    const double wy = g.dy / kLink - uy;
    const double scale = 1 / (kLink * (wy * ux - wx * uy));  // -1 / (dh/dpsi), the gain is one
    row[0] = -(wx * ux + wy * uy) * scale;
    row[1] = -scale;
    row[2] = -(wx * base_cos_ + wy * base_sin_) * scale;
    row[3] = -kBaseRadius * (wy * base_cos_ - wx * base_sin_) * scale;
    row[4] = (wx * g.cos + wy * g.sin) * scale;
    row[5] = kPlatformRadius * (wy * g.cos - wx * g.sin) * scale;
    // The reading, one turn about the leg's direction to the centre.
    row[6] = -std::atan2(offset_cos_ * uy - offset_sin_ * ux, offset_cos_ * ux + offset_sin_ * uy);
    row[7] = -1;
    if (by_pose != nullptr) {
      by_pose[0] = wx * scale;
      by_pose[1] = wy * scale;
      by_pose[2] = row[5];
    }
  }

 private:
  static constexpr double kLink = 1.5;
  static constexpr double kRootOfThree = 1.7320508075688772;
  static constexpr double kBaseRadius = 6 / kRootOfThree;
  static constexpr double kPlatformRadius = 1.5 / kRootOfThree;

  // d = b - A and the direction of b from the platform's centre.
  struct Geometry {
    Geometry(const PaperLeg& leg, const double* pose)
        : cos(std::cos(pose[2] + leg.platform_angle_)),
          sin(std::sin(pose[2] + leg.platform_angle_)),
          dx(pose[0] + kPlatformRadius * cos - kBaseRadius * leg.base_cos_),
          dy(pose[1] + kPlatformRadius * sin - kBaseRadius * leg.base_sin_) {}
    double cos, sin, dx, dy;
  };

  double platform_angle_;
  double base_cos_, base_sin_, offset_cos_, offset_sin_;
};

inline bool well_conditioned(const double* pose) {
  constexpr double kReachMargin = 0.05;
  constexpr double kConditionLimit = 20;
  Eigen::Matrix3d jacobian;
  for (int m = 0; m < 3; ++m) {
    const PaperLeg leg(m * 120 * PaperLeg::kDegree);
    if (leg.reach_margin(pose) < kReachMargin) {
      return false;
    }
    double row[PaperLeg::kParameters], by_pose[3];
    leg.row(pose, row, by_pose);
    jacobian.row(m) = Eigen::Map<const Eigen::RowVector3d>(by_pose);
  }
  // The eigenvalues of J^T J in closed form.
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
  const PaperLeg turned(leg * 120 * PaperLeg::kDegree);
  for (Index i = 0; i < poses.rows(); ++i) {
    turned.row(poses.row(i).data(), rows.row(i).data());
  }
  return rows;
}

}  // namespace symkin::testing
