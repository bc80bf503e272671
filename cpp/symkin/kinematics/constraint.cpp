// SPDX-License-Identifier: MIT
#include "symkin/kinematics/constraint.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

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

// The closures that bind the platform, without the readings, and their derivatives: of each pose a
// row, in which a closure has one number, and as many as there are coordinates.
struct Binding {
  RowMatrix closure, by_pose;

  Binding(const Mechanism& mechanism, const RowMatrix& poses) {
    const Index closures = mechanism.closures(), dof = mechanism.dof();
    const Index count = mechanism.dof() - mechanism.mobility();
    closure.resize(poses.rows(), count);
    by_pose.resize(poses.rows(), count * dof);
    ClosureRows rows;
    Index column = 0;
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const LegModel& model = mechanism.model(leg);
      const Index first = model.info().read ? 1 : 0;
      if (first == closures) {
        continue;
      }
      model.linearise_pose(mechanism.leg(leg).parameters, poses,
                           inverse_kinematics(mechanism, leg, poses), rows);
      if (first == 1) {
        rows.eliminate_reading(closures);
      }
      for (Index k = first; k < closures; ++k, ++column) {
        const auto own = Eigen::seqN(k, poses.rows(), closures);
        closure.col(column) = rows.closure(own);
        by_pose.middleCols(column * dof, dof) = rows.by_pose(own, kAll);
      }
    }
  }
};

}  // namespace

RowMatrix on_constraint(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  const Index dof = mechanism.dof();
  const std::vector<Index> bound = others(mechanism.free_coordinates(), dof);
  if (bound.empty()) {
    return poses;
  }
  if (const Index closures = dof - mechanism.mobility();
      closures != static_cast<Index>(bound.size())) {
    throw InvalidInput("mechanism \"" + mechanism.name() + "\" has " + std::to_string(closures) +
                       " equations that bind its platform; expected " +
                       std::to_string(bound.size()) + ", one for each coordinate that is not free");
  }
  const PoseSpace space = mechanism.pose_space();
  const Vector origin = identity_pose(space);
  RowMatrix result = poses;
  RowMatrix coordinates(poses.rows(), dof);
  for (Index i = 0; i < poses.rows(); ++i) {
    pose_difference(space, poses.row(i).data(), origin.data(), coordinates.row(i).data());
  }
  std::vector<Index> left(static_cast<std::size_t>(poses.rows()));
  std::iota(left.begin(), left.end(), Index{0});
  RowMatrix by_coordinates = RowMatrix::Identity(dof, dof);
  for (int iteration = 0; iteration < kMaxIterations && !left.empty(); ++iteration) {
    const Binding all(mechanism, result(left, kAll));
    std::vector<Index> moving;
    for (Index k = 0; k < all.closure.rows(); ++k) {
      const Index i = left[static_cast<std::size_t>(k)];
      // The tangent is a rotation on the left, a coordinate a component of the rotation vector.
      by_coordinates.bottomRightCorner<3, 3>() =
          left_jacobian(coordinates.row(i).tail<3>().transpose());
      const Eigen::Map<const RowMatrix> by_pose(all.by_pose.row(k).data(), all.closure.cols(), dof);
      const Vector step = -solution(product(by_pose, by_coordinates(kAll, bound)),
                                    Vector(all.closure.row(k).transpose()));
      coordinates.row(i)(bound) += step;
      result.row(i) = origin.transpose();
      move_pose(space, coordinates.row(i).data(), result.row(i).data());
      if (step.cwiseAbs().maxCoeff() > kStill) {  // and not where it is not a number
        moving.push_back(i);
      }
    }
    left = std::move(moving);
  }
  for (const Index i : left) {
    result.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  for (Index i = 0; i < poses.rows(); ++i) {
    if (!result.row(i).allFinite()) {
      result.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return result;
}

}  // namespace symkin
