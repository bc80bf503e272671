// SPDX-License-Identifier: MIT
#include "symkin/identification/joint_estimator.hpp"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/QR>
#include <cmath>

#include "symkin/identification/costs.hpp"
#include "symkin/identification/covariance.hpp"
#include "symkin/kinematics.hpp"

namespace symkin {
namespace {

constexpr int kMaxReweightings = 20;

// The legs that were read at one pose and the whitening W of their closures: W'W is the inverse of
// their covariance.
struct PoseWhitening {
  std::vector<Index> legs;
  Eigen::MatrixXd whitening;
};

std::vector<PoseWhitening> whiten(const Mechanism& mechanism, const MeasurementSet& measurements,
                                  const std::vector<ClosureRows>& rows,
                                  const MeasurementNoise& noise) {
  std::vector<PoseWhitening> all(static_cast<std::size_t>(measurements.poses.rows()));
  for (Index i = 0; i < measurements.poses.rows(); ++i) {
    PoseWhitening& pose = all[static_cast<std::size_t>(i)];
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      if (std::isfinite(measurements.readings(i, leg))) {
        pose.legs.push_back(leg);
      }
    }
    const auto count = static_cast<Index>(pose.legs.size());
    Eigen::MatrixXd by_pose(count, mechanism.dof());
    Vector by_reading(count);
    for (Index k = 0; k < count; ++k) {
      const ClosureRows& leg =
          rows[static_cast<std::size_t>(pose.legs[static_cast<std::size_t>(k)])];
      by_pose.row(k) = leg.by_pose.row(i);
      by_reading[k] = leg.by_reading[i];
    }
    const Eigen::MatrixXd factor =
        joint_closure_factor(by_pose, by_reading, mechanism.pose_space(), noise, i);
    pose.whitening =
        factor.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(count, count));
  }
  return all;
}

std::vector<ClosureRows> linearise_all(const Mechanism& mechanism,
                                       const MeasurementSet& measurements) {
  std::vector<ClosureRows> rows;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    rows.push_back(linearise(mechanism, leg, measurements.poses, measurements.readings.col(leg)));
  }
  return rows;
}

SolverOutcome fit(const Mechanism& mechanism, const MeasurementSet& measurements,
                  const std::vector<PoseWhitening>& whitenings,
                  const IdentificationOptions& options, RowMatrix& parameters) {
  std::vector<std::vector<std::unique_ptr<ceres::CostFunction>>> closures;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    closures.push_back(
        mechanism.model().closure_costs(measurements.poses, measurements.readings.col(leg)));
  }
  const auto loss = options.loss.make(std::sqrt(static_cast<double>(mechanism.leg_count())));
  ceres::Problem problem(shared_loss());
  for (std::size_t i = 0; i < whitenings.size(); ++i) {
    std::vector<std::unique_ptr<ceres::CostFunction>> of_pose;
    std::vector<double*> blocks;
    for (const Index leg : whitenings[i].legs) {
      of_pose.push_back(std::move(closures[static_cast<std::size_t>(leg)][i]));
      blocks.push_back(parameters.row(leg).data());
    }
    if (!of_pose.empty()) {
      problem.AddResidualBlock(new JointCost(std::move(of_pose), whitenings[i].whitening),
                               loss.get(), blocks);
    }
  }
  return solve_dense(problem, options.max_iterations);
}

// Inverse of the information of all whitened rows.
RowMatrix joint_covariance(const Mechanism& mechanism, const std::vector<ClosureRows>& rows,
                           const std::vector<PoseWhitening>& whitenings) {
  const Index p = mechanism.parameter_count();
  Index count = 0;
  for (const PoseWhitening& pose : whitenings) {
    count += static_cast<Index>(pose.legs.size());
  }
  Eigen::MatrixXd whitened = Eigen::MatrixXd::Zero(count, mechanism.leg_count() * p);
  Index first = 0;
  for (std::size_t i = 0; i < whitenings.size(); ++i) {
    const auto legs = static_cast<Index>(whitenings[i].legs.size());
    for (Index k = 0; k < legs; ++k) {
      const Index leg = whitenings[i].legs[static_cast<std::size_t>(k)];
      const auto& row =
          rows[static_cast<std::size_t>(leg)].by_parameters.row(static_cast<Index>(i));
      whitened.block(first, leg * p, legs, p) = whitenings[i].whitening.col(k) * row;
    }
    first += legs;
  }
  return inverse_information(whitened);
}

}  // namespace

JointEstimate estimate_joint(const Mechanism& mechanism, const MeasurementSet& measurements,
                             const RowMatrix& start, const IdentificationOptions& options) {
  JointEstimate estimate;
  estimate.parameters = start;
  std::vector<ClosureRows> rows;
  std::vector<PoseWhitening> whitenings;
  for (int pass = 0; pass <= kMaxReweightings; ++pass) {
    rows = linearise_all(mechanism.with_parameters(estimate.parameters), measurements);
    whitenings = whiten(mechanism, measurements, rows, options.noise);
    if (pass > 0 && !estimate.outcome.converged) {
      break;
    }
    const RowMatrix before = estimate.parameters;
    const int iterations = estimate.outcome.iterations;
    estimate.outcome = fit(mechanism, measurements, whitenings, options, estimate.parameters);
    estimate.outcome.iterations += iterations;
    const RowMatrix size = estimate.parameters.cwiseAbs().cwiseMax(1);
    if ((estimate.parameters - before).cwiseQuotient(size).lpNorm<Eigen::Infinity>() < 1e-9) {
      break;
    }
  }
  estimate.covariance = joint_covariance(mechanism, rows, whitenings);
  return estimate;
}

}  // namespace symkin
