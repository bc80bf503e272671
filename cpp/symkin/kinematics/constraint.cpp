// SPDX-License-Identifier: MIT
#include "symkin/kinematics/constraint.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

constexpr int kMaxIterations = 30;
constexpr double kStill = 1e-12;  // m and rad; the step that is as short is still taken

std::vector<Index> others(const std::vector<Index>& free, Index dof) {
  std::vector<Index> bound;
  for (Index i = 0; i < dof; ++i) {
    if (std::find(free.begin(), free.end(), i) == free.end()) {
      bound.push_back(i);
    }
  }
  return bound;
}

// The step of the bound coordinates at one pose, by the closures that do not show the reading.
Vector step_at(const PoseDerivatives& all, Index pose, const RowMatrix& by_coordinates,
               const std::vector<Index>& bound, Index closures) {
  const Index dof = by_coordinates.rows();
  const Index count = all.closure.cols();
  const Eigen::Map<const RowMatrix> by_pose(all.by_pose.row(pose).data(), count, dof);
  RowMatrix matrix(count - count / closures, static_cast<Index>(bound.size()));
  Vector values(matrix.rows());
  Index row = 0;
  const RowMatrix by_bound = product(by_pose, by_coordinates(kAll, bound));
  for (Index k = 0; k < count; ++k) {
    if (k % closures != 0) {
      matrix.row(row) = by_bound.row(k);
      values[row++] = all.closure(pose, k);
    }
  }
  return -solution(matrix, values);
}

}  // namespace

RowMatrix on_constraint(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  const Index dof = mechanism.dof();
  const std::vector<Index> bound = others(free_coordinates(mechanism.model(0).info()), dof);
  if (bound.empty()) {
    return poses;
  }
  const PoseSpace space = mechanism.pose_space();
  const Index closures = mechanism.closures();
  const Vector origin = identity_pose(space);
  RowMatrix result = poses;
  RowMatrix coordinates(poses.rows(), dof);
  for (Index i = 0; i < poses.rows(); ++i) {
    pose_difference(space, poses.row(i).data(), origin.data(), coordinates.row(i).data());
  }
  std::vector<bool> done(static_cast<std::size_t>(poses.rows()), false);
  RowMatrix by_coordinates = RowMatrix::Identity(dof, dof);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    PoseDerivatives all = linearise_pose(mechanism, result, inverse_kinematics(mechanism, result));
    all.eliminate_reading(closures);
    bool all_done = true;
    for (Index i = 0; i < poses.rows(); ++i) {
      if (done[static_cast<std::size_t>(i)]) {
        continue;
      }
      // The tangent is a rotation on the left, a coordinate a component of the rotation vector.
      by_coordinates.bottomRightCorner<3, 3>() =
          left_jacobian(coordinates.row(i).tail<3>().transpose());
      const Vector step = step_at(all, i, by_coordinates, bound, closures);
      coordinates.row(i)(bound) += step;
      result.row(i) = origin.transpose();
      move_pose(space, coordinates.row(i).data(), result.row(i).data());
      const double size = step.cwiseAbs().maxCoeff();
      done[static_cast<std::size_t>(i)] = !(size > kStill);  // also where it is not a number
      all_done = all_done && !(size > kStill);
    }
    if (all_done) {
      break;
    }
  }
  for (Index i = 0; i < poses.rows(); ++i) {
    if (!done[static_cast<std::size_t>(i)] || !result.row(i).allFinite()) {
      result.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return result;
}

}  // namespace symkin
