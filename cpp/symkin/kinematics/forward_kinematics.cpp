// SPDX-License-Identifier: MIT
#include "symkin/kinematics/forward_kinematics.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/frame.hpp"
#include "symkin/model/one_by_one_newton.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
std::vector<std::string> open_coordinates(const Mechanism& mechanism, ConstVector pose) {
  static constexpr std::array<const char*, 6> kNames{"x", "y", "z", "rx", "ry", "rz"};
  const RowMatrix at = pose.transpose();
  check_poses(mechanism, at);
  if (!mechanism.underdetermined()) {
    return {};
  }
  const Index dof = mechanism.dof();
  const PoseDerivatives all = linearise_pose(mechanism, at, inverse_kinematics(mechanism, at));
  RowMatrix rows = Eigen::Map<const RowMatrix>(all.by_pose.data(), all.closure.cols(), dof);
  std::vector<Index> open;
  for (Index left = dof - rows.rows(); left > 0; --left) {
    // What cannot move is bound; the freest of the others is bound next.
    const RowMatrix bound = column_space(rows.transpose()).basis;
    const Vector free = Vector::Ones(dof) - bound.rowwise().squaredNorm();
    Index freest = 0;
    free.maxCoeff(&freest);
    open.push_back(freest);
    rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
    rows.bottomRows<1>() = Eigen::RowVectorXd::Unit(dof, freest);
  }
  std::sort(open.begin(), open.end());
  std::vector<std::string> names;
  names.reserve(open.size());
  for (const Index each : open) {
    names.emplace_back(kNames[static_cast<std::size_t>(
        pose_slots(mechanism.pose_space())[static_cast<std::size_t>(each)])]);
  }
  return names;
}

void ForwardKinematicsOptions::check() const {
  if (max_iterations < 1) {
    throw InvalidInput("max_iterations = " + std::to_string(max_iterations) +
                       "; expected at least 1");
  }
  if (!(step_tolerance > 0)) {
    throw InvalidInput("step_tolerance must be positive");
  }
}

Index ForwardKinematicsResult::converged_count() const {
  return std::count(status.begin(), status.end(), ForwardStatus::converged);
}

ForwardKinematicsResult forward_kinematics(const Mechanism& mechanism, ConstRows readings,
                                           ConstRows start,
                                           const ForwardKinematicsOptions& options) {
  ForwardKinematicsResult result;
  forward_kinematics(mechanism, RowMatrix(readings), start, options, result);
  return result;
}

void forward_kinematics(const Mechanism& mechanism, const RowMatrix& readings, ConstRows start,
                        const ForwardKinematicsOptions& options, ForwardKinematicsResult& result) {
  options.check();
  check_poses(mechanism, start);
  check_readings(mechanism, readings.rows(), readings);
  if (start.rows() != 1 && start.rows() != readings.rows()) {
    throw InvalidInput("start has " + std::to_string(start.rows()) + " poses; expected 1 or " +
                       std::to_string(readings.rows()) + ", one a row of readings");
  }
  if (mechanism.underdetermined()) {
    const Index bound = mechanism.leg_count() * mechanism.closures();
    std::string names;
    for (const std::string& each : open_coordinates(mechanism, start.row(0).transpose())) {
      names += (names.empty() ? "" : ", ") + each;
    }
    throw InvalidInput("the readings of " + std::to_string(mechanism.leg_count()) +
                       " legs determine " + std::to_string(bound) + " of the platform's " +
                       std::to_string(mechanism.dof()) + " coordinates and leave " + names +
                       " to gravity; expected " + names + " measured beside them");
  }
  if (const ChainModel* const chain = mechanism.chain()) {
    chain->forward_kinematics(mechanism.leg_values(), readings, start, options, result.poses,
                              result.status);
  } else {
    LegsOneByOne legs{{}, mechanism.leg_values()};
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      legs.models.push_back(&mechanism.model(leg));
    }
    forward_kinematics(legs, readings, start, options, result.poses, result.status);
  }
}

}  // namespace symkin
