// SPDX-License-Identifier: MIT
#include "symkin/estimation/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "symkin/kinematics/constraint.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"

namespace symkin {
namespace {

constexpr Index kBlock = 2048;  // poses whose readings stay in the cache

// Taken less wanted, N x dof, or NaN.
void compare(PoseSpace space, const ForwardKinematicsResult& taken, ConstRows wanted,
             Rows differences) {
  for (Index i = 0; i < wanted.rows(); ++i) {
    if (taken.status[static_cast<std::size_t>(i)] == ForwardStatus::converged) {
      pose_difference(space, taken.poses.row(i).data(), wanted.row(i).data(),
                      differences.row(i).data());
    } else {
      differences.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

PoseErrors summarise(PoseSpace space, RowMatrix differences) {
  const Index position = position_size(space);
  const Index dof = degrees_of_freedom(space);
  PoseErrors errors;
  for (Index i = 0; i < differences.rows(); ++i) {
    const double* const row = differences.row(i).data();
    if (std::isnan(row[0])) {
      ++errors.failed;
      continue;
    }
    const auto square = [&](Index first, Index end) {
      return std::inner_product(row + first, row + end, row + first, 0.0);
    };
    const double distance = square(0, position);
    const double angle = square(position, dof);
    errors.position_rms += distance;
    errors.orientation_rms += angle;
    errors.position_max = std::max(errors.position_max, distance);
    errors.orientation_max = std::max(errors.orientation_max, angle);
    ++errors.evaluated;
  }
  const double count = static_cast<double>(std::max<Index>(errors.evaluated, 1));
  errors.position_rms = std::sqrt(errors.position_rms / count);
  errors.orientation_rms = std::sqrt(errors.orientation_rms / count);
  errors.position_max = std::sqrt(errors.position_max);
  errors.orientation_max = std::sqrt(errors.orientation_max);
  errors.differences = std::move(differences);
  return errors;
}

}  // namespace

PoseErrors command_errors(const Mechanism& actual, const Mechanism& model, ConstRows commanded) {
  const bool bound = model.mobility() < model.dof();  // otherwise all poses are as they should be
  RowMatrix differences(commanded.rows(), actual.dof());
  ForwardKinematicsResult taken;
  for (Index first = 0; first < commanded.rows(); first += kBlock) {
    const Index count = std::min(kBlock, commanded.rows() - first);
    const ConstRows block = commanded.middleRows(first, count);
    const RowMatrix moved = bound ? on_constraint(model, block) : RowMatrix();
    const ConstRows poses = bound ? ConstRows(moved) : block;
    forward_kinematics(actual, inverse_kinematics(model, poses), poses, {}, taken);
    compare(actual.pose_space(), taken, poses, differences.middleRows(first, count));
  }
  return summarise(actual.pose_space(), std::move(differences));
}

PoseErrors measurement_errors(const Mechanism& model, ConstRows measured, ConstRows readings) {
  check_readings(model, measured.rows(), readings);
  RowMatrix differences(measured.rows(), model.dof());
  compare(model.pose_space(), forward_kinematics(model, readings, measured), measured, differences);
  return summarise(model.pose_space(), std::move(differences));
}

}  // namespace symkin
