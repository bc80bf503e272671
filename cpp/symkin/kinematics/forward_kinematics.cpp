// SPDX-License-Identifier: MIT
#include "symkin/kinematics/forward_kinematics.hpp"

#include <algorithm>
#include <string>

#include "symkin/model/one_by_one_newton.hpp"
#include "symkin/support/error.hpp"

namespace symkin {

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
