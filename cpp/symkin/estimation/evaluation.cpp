// SPDX-License-Identifier: MIT
#include "symkin/estimation/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/kinematics/constraint.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"

namespace symkin {
namespace {

PoseErrors compare(PoseSpace space, const ForwardKinematicsResult& taken, ConstRows wanted) {
  const Index position = position_size(space);
  const Index orientation = degrees_of_freedom(space) - position;
  PoseErrors errors;
  errors.differences.setConstant(wanted.rows(), degrees_of_freedom(space),
                                 std::numeric_limits<double>::quiet_NaN());
  double position_sum = 0;
  double orientation_sum = 0;
  for (Index i = 0; i < wanted.rows(); ++i) {
    if (taken.status[static_cast<std::size_t>(i)] != ForwardStatus::converged) {
      ++errors.failed;
      continue;
    }
    auto row = errors.differences.row(i);
    pose_difference(space, taken.poses.row(i).data(), wanted.row(i).data(), row.data());
    const double distance = row.head(position).squaredNorm();
    const double angle = row.tail(orientation).squaredNorm();
    position_sum += distance;
    orientation_sum += angle;
    errors.position_max = std::max(errors.position_max, std::sqrt(distance));
    errors.orientation_max = std::max(errors.orientation_max, std::sqrt(angle));
    ++errors.evaluated;
  }
  const double count = static_cast<double>(std::max<Index>(errors.evaluated, 1));
  errors.position_rms = std::sqrt(position_sum / count);
  errors.orientation_rms = std::sqrt(orientation_sum / count);
  return errors;
}

}  // namespace

PoseErrors command_errors(const Mechanism& actual, const Mechanism& model, ConstRows commanded) {
  const RowMatrix poses = on_constraint(model, commanded);
  const RowMatrix readings = inverse_kinematics(model, poses);
  ForwardKinematicsResult taken;
  forward_kinematics(actual, readings, poses, {}, taken);
  return compare(actual.pose_space(), taken, poses);
}

PoseErrors measurement_errors(const Mechanism& model, ConstRows measured, ConstRows readings) {
  check_readings(model, measured.rows(), readings);
  return compare(model.pose_space(), forward_kinematics(model, readings, measured), measured);
}

}  // namespace symkin
