// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/closed_form_frames.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Of a planar problem, about Z.
Eigen::Matrix3d nearest_rotation(Eigen::Matrix3d matrix, bool planar) {
  if (planar) {
    matrix.row(2).setZero();
    matrix.col(2).setZero();
    matrix(2, 2) = matrix.norm() + 1;
  }
  const RowMatrix m = matrix;
  const RightSingular svd = right_singular(m);  // m = U S V'
  const Eigen::Matrix3d v = svd.vectors;
  Eigen::Matrix3d u = matrix * v;
  u.col(0).normalize();
  u.col(1) -= u.col(0) * u.col(0).dot(u.col(1));
  u.col(1) = u.col(1).norm() > 0 ? u.col(1).normalized() : u.col(0).unitOrthogonal();
  u.col(2) = u.col(0).cross(u.col(1)) * (v.determinant() < 0 ? -1 : 1);
  return u * v.transpose();
}

// Of the least squares of rows x - values.
Vector shortest_solution(const RowMatrix& rows, const Vector& values) {
  return symmetric_inverse(product(rows.transpose(), rows)).matrix * (rows.transpose() * values);
}

// Both positions for the rotations, linear: of the target what the tilts do not show stays as
// given.
void place(const std::vector<SeenPose>& pairs, const FramePair& given, const RowMatrix& shown,
           FramePair& frames) {
  const auto count = static_cast<Index>(pairs.size());
  RowMatrix rows(3 * count, 3 + shown.cols());
  Vector values(3 * count);
  for (Index k = 0; k < count; ++k) {
    const SeenPose& pair = pairs[static_cast<std::size_t>(k)];
    const Eigen::Matrix3d turned = frames.base.rotation * pair.robot.rotation;
    rows.block<3, 3>(3 * k, 0).setIdentity();
    rows.block(3 * k, 3, 3, shown.cols()) = turned * shown;
    values.segment<3>(3 * k) = pair.seen.position - frames.base.rotation * pair.robot.position -
                               turned * given.target.position;
  }
  const Vector solution = shortest_solution(rows, values);
  frames.base.position = solution.head<3>();
  frames.target.position = given.target.position + shown * solution.tail(shown.cols());
}

// Positions alone: the rotation between two clouds of points (Kabsch) and the lever arm by turns.
FramePair by_positions(const std::vector<SeenPose>& pairs, const FramePair& given,
                       const RowMatrix& shown, bool target, bool planar) {
  FramePair found = given;
  constexpr int kAlternations = 50;
  constexpr double kStill = 1e-9;
  double turned = 1;
  for (int i = 0; i < kAlternations && turned > kStill; ++i) {
    Eigen::Vector3d mean_robot = Eigen::Vector3d::Zero();
    Eigen::Vector3d mean_seen = Eigen::Vector3d::Zero();
    for (const SeenPose& pair : pairs) {
      mean_robot += pair.robot.position + pair.robot.rotation * found.target.position;
      mean_seen += pair.seen.position;
    }
    mean_robot /= static_cast<double>(pairs.size());
    mean_seen /= static_cast<double>(pairs.size());
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (const SeenPose& pair : pairs) {
      const Eigen::Vector3d at =
          pair.robot.position + pair.robot.rotation * found.target.position - mean_robot;
      moment += (pair.seen.position - mean_seen) * at.transpose();
    }
    const Eigen::Matrix3d before = found.base.rotation;
    found.base.rotation = nearest_rotation(moment, planar);
    turned = (found.base.rotation - before).norm();
    found.base.position = mean_seen - found.base.rotation * mean_robot;
    if (!target) {
      return found;
    }
    place(pairs, given, shown, found);
  }
  return found;
}

// Dominant singular pair of the mean of R_P (x) R_Y: vec(R_B) and vec(R_T').
FramePair by_orientations(const std::vector<SeenPose>& pairs, const FramePair& given) {
  RowMatrix mean = RowMatrix::Zero(9, 9);
  for (const SeenPose& pair : pairs) {
    for (Index i = 0; i < 3; ++i) {
      for (Index j = 0; j < 3; ++j) {
        mean.block<3, 3>(3 * i, 3 * j) += pair.robot.rotation(i, j) * pair.seen.rotation;
      }
    }
  }
  const RightSingular svd = right_singular(mean);
  const Vector right = svd.vectors.col(0);
  const Vector left = mean * right;
  Eigen::Matrix3d target = Eigen::Map<const Eigen::Matrix3d>(right.data());
  Eigen::Matrix3d base = Eigen::Map<const Eigen::Matrix3d>(left.data());
  const double sign = base.determinant() < 0 ? -1 : 1;
  FramePair found = given;
  found.base.rotation = nearest_rotation(sign * base, false);
  found.target.rotation = nearest_rotation((sign * target).transpose(), false);
  return found;
}

// p_Y = b + M p_P + R_Y tau, linear in b, M and tau = R_T' t.
FramePair by_lever_arm(const std::vector<SeenPose>& pairs, const FramePair& given, bool planar) {
  RowMatrix rows = RowMatrix::Zero(3 * static_cast<Index>(pairs.size()), 15);
  Vector values(rows.rows());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto at = 3 * static_cast<Index>(k);
    rows.block<3, 3>(at, 0).setIdentity();
    for (Index i = 0; i < 3; ++i) {
      rows.block<1, 3>(at + i, 3 + 3 * i) = pairs[k].robot.position.transpose();
    }
    rows.block<3, 3>(at, 12) = pairs[k].seen.rotation;
    values.segment<3>(at) = pairs[k].seen.position;
  }
  const Vector solution = shortest_solution(rows, values);
  Eigen::Matrix3d m;
  for (Index i = 0; i < 3; ++i) {
    m.row(i) = solution.segment<3>(3 + 3 * i);
  }
  FramePair found = given;
  found.base.rotation = nearest_rotation(m, planar);
  return found;
}

// The target's rotation and both positions for the base's rotation.
FramePair completed(const std::vector<SeenPose>& pairs, const FramePair& given,
                    const RowMatrix& shown, bool target, FramePair frames) {
  if (target) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const SeenPose& pair : pairs) {
      const Eigen::Matrix3d turned = frames.base.rotation * pair.robot.rotation;
      sum += turned.transpose() * pair.seen.rotation;
    }
    frames.target.rotation = nearest_rotation(sum, false);
  }
  place(pairs, given, shown, frames);
  return frames;
}

}  // namespace

RowMatrix shown_places(const std::vector<SeenPose>& pairs) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const SeenPose& pair : pairs) {
    mean += pair.robot.rotation / static_cast<double>(pairs.size());
  }
  RowMatrix tilts = RowMatrix::Zero(3, 3);
  for (const SeenPose& pair : pairs) {
    const Eigen::Matrix3d off = pair.robot.rotation - mean;
    tilts += off.transpose() * off / static_cast<double>(pairs.size());
  }
  const SymmetricEigen eigen = symmetric_eigen(tilts);
  return eigen.vectors.rightCols((eigen.values.array() > kHardlyTilted * kHardlyTilted).count());
}

std::vector<FramePair> closed_form_frames(const std::vector<SeenPose>& pairs,
                                          const FramePair& given, const FrameQuestion& asked) {
  std::vector<FramePair> starts{given};
  const bool planar = position_size(asked.space) == 2;
  const bool positions = position_size(asked.space) > 0;
  const RowMatrix shown = asked.target ? shown_places(pairs) : RowMatrix(3, 0);
  const auto with_the_rest = [&](const FramePair& frames, bool target) {
    return completed(pairs, given, shown, target, frames);
  };
  if (asked.base) {
    if (positions) {
      starts.push_back(by_positions(pairs, given, shown, asked.target, planar));
    }
    if (asked.all_turned) {
      starts.push_back(with_the_rest(starts.back(), asked.target));
      if (asked.target) {
        if (!planar) {  // all turns about one axis leave it open
          starts.push_back(with_the_rest(by_orientations(pairs, given), true));
        }
        if (positions) {
          starts.push_back(with_the_rest(by_lever_arm(pairs, given, planar), true));
        }
      } else {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (const SeenPose& pair : pairs) {
          const Eigen::Matrix3d target_turned = pair.robot.rotation * given.target.rotation;
          sum += pair.seen.rotation * target_turned.transpose();
        }
        FramePair turned = given;
        turned.base.rotation = nearest_rotation(sum, false);
        starts.push_back(with_the_rest(turned, false));
      }
    }
  } else if (asked.target && asked.all_turned) {
    FramePair turned = with_the_rest(given, true);
    turned.base = given.base;
    starts.push_back(turned);
  }
  return starts;
}

}  // namespace symkin
