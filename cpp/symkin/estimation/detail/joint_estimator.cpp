// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/joint_estimator.hpp"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "symkin/estimation/detail/costs.hpp"
#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/leg_estimators.hpp"

namespace symkin {
namespace {

// A loss of the norm of so many whitened closures.
double pose_spread(Index closures, double spread) {
  return std::sqrt(static_cast<double>(closures)) * spread;
}

SolverOutcome fit(const Mechanism& mechanism, const MeasurementSet& measurements,
                  const WhitenedClosures& system, const IdentificationOptions& options,
                  double spread, RowMatrix& parameters) {
  std::vector<std::vector<std::unique_ptr<ceres::CostFunction>>> closures;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    closures.push_back(
        mechanism.model().closure_costs(measurements.poses, measurements.readings.col(leg)));
  }
  std::map<Index, std::unique_ptr<ceres::LossFunction>> losses;  // by the number of closures
  ceres::Problem problem(shared_loss());
  for (const WhitenedPose& pose : system.poses) {
    std::vector<std::unique_ptr<ceres::CostFunction>> of_pose;
    std::vector<double*> blocks;
    for (const Index leg : pose.legs) {
      of_pose.push_back(
          std::move(closures[static_cast<std::size_t>(leg)][static_cast<std::size_t>(pose.row)]));
      blocks.push_back(parameters.row(leg).data());
    }
    auto& loss = losses[pose.count()];
    if (loss == nullptr) {
      loss = options.loss.make(pose_spread(pose.count(), spread));
    }
    Eigen::MatrixXd whitening = pose.factor.triangularView<Eigen::Lower>().solve(
        Eigen::MatrixXd::Identity(pose.count(), pose.count()));
    problem.AddResidualBlock(new JointCost(std::move(of_pose), std::move(whitening)), loss.get(),
                             blocks);
  }
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    if (problem.HasParameterBlock(parameters.row(leg).data())) {
      hold_others(problem, parameters.row(leg).transpose(), mechanism.estimated_parameters(leg));
    }
  }
  return solve_dense(problem, options.max_iterations);
}

Vector weights_of_poses(const WhitenedClosures& system, const RobustLoss& loss, double spread) {
  Vector weights(static_cast<Index>(system.poses.size()));
  for (std::size_t k = 0; k < system.poses.size(); ++k) {
    const WhitenedPose& pose = system.poses[k];
    const double norm = system.residual.segment(pose.first, pose.count()).norm();
    weights[static_cast<Index>(k)] = loss.weight(norm, pose_spread(pose.count(), spread));
  }
  return weights;
}

}  // namespace

JointEstimate estimate_joint(const Mechanism& mechanism, const MeasurementSet& measurements,
                             const RowMatrix& start, const IdentificationOptions& options) {
  const std::vector<Index> legs = all_legs(mechanism.leg_count());
  const auto system_at = [&](const RowMatrix& parameters) {
    return whiten_closures(mechanism.model(), parameters, mechanism.estimated_parameters(),
                           measurements, legs, PoseUse::all, options.noise);
  };
  JointEstimate estimate;
  estimate.parameters = start;
  estimate.system = system_at(start);
  double spread = options.loss.spread(estimate.system.residual);
  Eigen::Map<Vector> parameters(estimate.parameters.data(), estimate.parameters.size());
  estimate.outcome = fit_until_still(parameters, [&] {
    SolverOutcome outcome =
        fit(mechanism, measurements, estimate.system, options, spread, estimate.parameters);
    estimate.system = system_at(estimate.parameters);
    spread = options.loss.spread(estimate.system.residual);
    return outcome;
  });
  estimate.loss_weights = weights_of_poses(estimate.system, options.loss, spread);
  return estimate;
}

RowMatrix joint_covariance(const JointEstimate& estimate) {
  Eigen::MatrixXd weighted = estimate.system.jacobian;
  for (std::size_t k = 0; k < estimate.system.poses.size(); ++k) {
    const WhitenedPose& pose = estimate.system.poses[k];
    weighted.middleRows(pose.first, pose.count()) *=
        std::sqrt(estimate.loss_weights[static_cast<Index>(k)]);
  }
  return inverse_information(weighted);
}

}  // namespace symkin
