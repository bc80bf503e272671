// SPDX-License-Identifier: MIT
#include "symkin/estimation/accuracy.hpp"

#include <cmath>
#include <string>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {

AccuracyWeights accuracy_weights(const Mechanism& mechanism, ConstRows poses) {
  if (poses.rows() == 0) {
    throw InvalidInput("there are no poses to average the accuracy over");
  }
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  const Index legs = mechanism.leg_count();
  const Index p = mechanism.parameter_count();
  const Index closures = mechanism.closures();
  const Index dof = mechanism.dof();
  const Index position = position_size(mechanism.pose_space());
  std::vector<ClosureRows> rows;
  for (Index leg = 0; leg < legs; ++leg) {
    rows.push_back(linearise(mechanism, leg, poses, readings.col(leg)));
  }
  AccuracyWeights weights;
  weights.position = RowMatrix::Zero(legs * p, legs * p);
  weights.orientation = weights.position;
  RowMatrix by_pose(legs * closures, dof);
  RowMatrix effect(dof, legs * p);
  for (Index i = 0; i < poses.rows(); ++i) {
    check_interrupt();
    for (Index leg = 0; leg < legs; ++leg) {
      by_pose.middleRows(leg * closures, closures) =
          rows[static_cast<std::size_t>(leg)].by_pose.middleRows(i * closures, closures);
    }
    const ColumnSpace space = column_space(by_pose);
    if (!by_pose.allFinite() || space.rank() < dof) {
      ++weights.failed;
      continue;
    }
    const RowMatrix inverse = product(space.coordinates, space.basis.transpose());
    for (Index leg = 0; leg < legs; ++leg) {
      effect.middleCols(leg * p, p) = product(
          inverse.middleCols(leg * closures, closures),
          rows[static_cast<std::size_t>(leg)].by_parameters.middleRows(i * closures, closures));
    }
    const auto moved = effect.topRows(position);
    const auto turned = effect.bottomRows(dof - position);
    weights.position += product(moved.transpose(), moved);
    weights.orientation += product(turned.transpose(), turned);
    ++weights.evaluated;
  }
  if (weights.evaluated == 0) {
    throw InvalidInput("mechanism \"" + mechanism.name() + "\" can take none of the " +
                       std::to_string(poses.rows()) + " poses over which accuracy is expected");
  }
  weights.position /= static_cast<double>(weights.evaluated);
  weights.orientation /= static_cast<double>(weights.evaluated);
  return weights;
}

ExpectedAccuracy expected_accuracy(const AccuracyWeights& weights, ConstRows covariance) {
  if (covariance.rows() != weights.position.rows() ||
      covariance.cols() != weights.position.cols()) {
    throw InvalidInput("the covariance is " + std::to_string(covariance.rows()) + " x " +
                       std::to_string(covariance.cols()) + "; expected " +
                       std::to_string(weights.position.rows()) + " x " +
                       std::to_string(weights.position.cols()) + ", the parameters of all legs");
  }
  return {std::sqrt(weights.position.cwiseProduct(covariance).sum()),
          std::sqrt(weights.orientation.cwiseProduct(covariance).sum())};
}

}  // namespace symkin
