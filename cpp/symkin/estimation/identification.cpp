// SPDX-License-Identifier: MIT
#include "symkin/estimation/identification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/joint_estimator.hpp"
#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

void check_measurements(const Mechanism& mechanism, const MeasurementSet& measurements) {
  check_poses(mechanism, measurements.poses);
  check_readings(mechanism, measurements.poses.rows(), measurements.readings);
  if (static_cast<Index>(measurements.leg_sets.size()) != measurements.poses.rows()) {
    throw InvalidInput("leg_sets has " + std::to_string(measurements.leg_sets.size()) +
                       " entries; expected one a pose, " +
                       std::to_string(measurements.poses.rows()));
  }
  if (!measurements.poses.allFinite()) {
    throw InvalidInput("a measured pose is not finite");
  }
}

LegData data_of_leg(const Mechanism& mechanism, const MeasurementSet& measurements, Index leg,
                    const std::vector<Index>& rows) {
  const auto count = static_cast<Index>(rows.size());
  if (count < mechanism.estimated_count()) {
    throw InvalidInput("leg " + std::to_string(leg + 1) + " was measured at " +
                       std::to_string(count) + " poses; its " +
                       std::to_string(mechanism.estimated_count()) +
                       " parameters need at least as many");
  }
  LegData data{mechanism.model(), mechanism.leg(leg).working_mode,
               RowMatrix(count, measurements.poses.cols()), Vector(count),
               mechanism.estimated_parameters(leg)};
  for (Index i = 0; i < count; ++i) {
    const Index row = rows[static_cast<std::size_t>(i)];
    data.poses.row(i) = measurements.poses.row(row);
    data.readings[i] = measurements.readings(row, leg);
  }
  return data;
}

LegEstimate estimate_leg(const LegData& data, const Vector& start,
                         const IdentificationOptions& options) {
  switch (options.estimator) {
    case Estimator::paper:
      return estimate_paper(data, start, options);
    case Estimator::inverse:
      return estimate_inverse(data, start, options);
    default:
      return estimate_implicit(data, start, options);
  }
}

// What the whitened closures of one leg show of its parameters.
struct LegSight {
  double condition;  // of the jacobian with columns of length one; infinite if it has no full rank
  RowMatrix unseen;  // p x (p - rank): combinations of parameters, in their own units
};

LegSight sight_of(const WhitenedClosures& system) {
  constexpr double kRank = 1e-10;
  const Index p = system.jacobian.cols();
  if (!system.jacobian.allFinite()) {
    return {std::numeric_limits<double>::infinity(), RowMatrix(p, 0)};
  }
  const Vector scale = inverse_column_lengths(system.jacobian);
  const RightSingular svd = right_singular(system.jacobian * scale.asDiagonal());
  const Vector& singular = svd.values;
  const Index rank = (singular.array() > kRank * singular[0]).count();
  const double condition =
      rank < p ? std::numeric_limits<double>::infinity() : singular[0] / singular[p - 1];
  return {condition, named_directions(svd.vectors.rightCols(p - rank), scale)};
}

void require_identifiable(const WhitenedClosures& system, const Mechanism& mechanism, Index leg) {
  const LegSight sight = sight_of(system);
  if (sight.unseen.cols() > 0) {
    RowMatrix unseen = RowMatrix::Zero(mechanism.parameter_count(), sight.unseen.cols());
    unseen(mechanism.estimated_parameters(leg), Eigen::all) = sight.unseen;
    throw NotIdentifiable("the measurements of leg " + std::to_string(leg + 1) +
                              " do not show all of its " + std::to_string(sight.unseen.rows()) +
                              " parameters",
                          unseen);
  }
}

// Residuals and their statistics at the estimate; `system` is the leg's own.
LegIdentification describe(const WhitenedClosures& system, const LegEstimate& estimate) {
  LegIdentification leg;
  const auto count = static_cast<Index>(system.poses.size());
  leg.residuals.resize(count);
  leg.standardised = system.residual;
  for (Index k = 0; k < count; ++k) {
    const WhitenedPose& pose = system.poses[static_cast<std::size_t>(k)];
    leg.rows.push_back(pose.row);
    leg.residuals[k] = system.rows.front().closure[pose.row];
    if (estimate.loss_weights[k] < kRejectedWeight) {
      leg.rejected.push_back(pose.row);
    }
  }
  leg.converged = estimate.outcome.converged;
  leg.failure = estimate.outcome.failure;
  leg.iterations = estimate.outcome.iterations;
  leg.condition = sight_of(system).condition;
  if (leg.converged && !(system.residual.allFinite() && std::isfinite(leg.condition))) {
    leg.converged = false;
    leg.failure = "the parameters that it ended at do not determine the closures";
  }
  return leg;
}

// How the leg's estimate answers to errors of its closures, at the estimate.
LegInfluence influence_of(const WhitenedClosures& system, const LegEstimate& estimate,
                          const std::vector<Index>& estimated, Estimator estimator) {
  const ClosureRows& all = system.rows.front();
  const auto count = static_cast<Index>(system.poses.size());
  LegInfluence leg;
  leg.by_pose.resize(count, all.by_pose.cols());
  leg.by_reading.resize(count);
  RowMatrix by_parameters(count, static_cast<Index>(estimated.size()));
  Vector factors(count);  // on h in the estimator's residual; the paper's is -h / (dh/dpsi)
  for (Index k = 0; k < count; ++k) {
    const WhitenedPose& pose = system.poses[static_cast<std::size_t>(k)];
    leg.rows.push_back(pose.row);
    leg.by_pose.row(k) = all.by_pose.row(pose.row);
    leg.by_reading[k] = all.by_reading[pose.row];
    by_parameters.row(k) = all.by_parameters.row(pose.row)(estimated);
    const bool in_readings = estimator == Estimator::paper || estimator == Estimator::inverse;
    factors[k] = 1 / (in_readings ? leg.by_reading[k] : pose.factor(0, 0));
  }
  const RowMatrix influence =
      least_squares_influence(by_parameters, factors, estimate.loss_weights);
  constexpr double kLeast = 1e-6;  // of 1 - leverage; a pose without which nothing is known has 0
  leg.deleted.resize(count);
  for (Index k = 0; k < count; ++k) {
    const double leverage = by_parameters.row(k).dot(influence.col(k));
    const double closure = all.closure[system.poses[static_cast<std::size_t>(k)].row];
    leg.deleted[k] = closure / std::max(1 - leverage, kLeast);
  }
  leg.influence = RowMatrix::Zero(all.by_parameters.cols(), count);
  leg.influence(estimated, Eigen::all) = influence;
  return leg;
}

// The rows of a leg whose poses the joint estimate rejects.
std::vector<Index> rejected_rows(const JointEstimate& joint, Index leg) {
  std::vector<Index> rows;
  for (std::size_t k = 0; k < joint.system.poses.size(); ++k) {
    const WhitenedPose& pose = joint.system.poses[k];
    const bool read = std::find(pose.legs.begin(), pose.legs.end(), leg) != pose.legs.end();
    if (read && joint.loss_weights[static_cast<Index>(k)] < kRejectedWeight) {
      rows.push_back(pose.row);
    }
  }
  return rows;
}

// Takes the statistics of the joint estimate in place of those of its start.
void describe_joint(const JointEstimate& joint, const Mechanism& mechanism,
                    Identification& result) {
  result.goodness = {goodness_of_fit(joint.system, joint.loss_weights, 1)};
  const double spread = result.goodness.front().spread();
  std::vector<Index> columns;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (const Index i : mechanism.estimated_parameters(leg)) {
      columns.push_back(leg * mechanism.parameter_count() + i);
    }
  }
  const Index all = mechanism.leg_count() * mechanism.parameter_count();
  result.covariance = RowMatrix::Zero(all, all);
  result.covariance(columns, columns) = spread * spread * joint_covariance(joint);
  for (std::size_t i = 0; i < result.legs.size(); ++i) {
    LegIdentification& leg = result.legs[i];
    leg.converged = joint.outcome.converged;
    leg.failure = joint.outcome.failure;
    leg.iterations += joint.outcome.iterations;
    leg.rejected = rejected_rows(joint, static_cast<Index>(i));
  }
}

void summarise(Identification& result) {
  double sum = 0;
  Index count = 0;
  result.converged = true;
  for (const LegIdentification& leg : result.legs) {
    sum += leg.residuals.squaredNorm();
    count += leg.residuals.size();
    result.residual_max = std::max(result.residual_max, leg.residuals.lpNorm<Eigen::Infinity>());
    result.converged = result.converged && leg.converged;
  }
  result.residual_rms = std::sqrt(sum / static_cast<double>(count));
}

}  // namespace

void IdentificationOptions::check() const {
  noise.check();
  loss.check();
  if (estimator == Estimator::paper && loss.kind != RobustLoss::Kind::none) {
    throw InvalidInput("the estimator \"paper\" has no robust loss; use \"inverse\"");
  }
  if (estimator == Estimator::joint && use == PoseUse::own) {
    throw InvalidInput("the estimator \"joint\" uses every pose for every leg");
  }
  if (max_iterations < 1) {
    throw InvalidInput("max_iterations = " + std::to_string(max_iterations) +
                       "; expected at least 1");
  }
}

Identification identify(const Mechanism& mechanism, const MeasurementSet& measurements,
                        const IdentificationOptions& options) {
  options.check();
  check_one_closure(mechanism.model().info(), "identification");
  check_measurements(mechanism, measurements);
  const auto estimated = mechanism.estimated_parameters();
  const auto leg_system = [&](ConstRows parameters, Index leg) {
    return whiten_closures(mechanism.model(), parameters, estimated, measurements, {leg},
                           options.use, options.noise);
  };
  std::vector<LegEstimate> estimates;
  Identification result;
  result.parameters = mechanism.parameters();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const LegData data =
        data_of_leg(mechanism, measurements, leg, rows_of_leg(measurements, leg, options.use));
    require_identifiable(leg_system(mechanism.parameters(), leg), mechanism, leg);
    estimates.push_back(estimate_leg(data, mechanism.leg(leg).parameters, options));
    result.parameters.row(leg) = estimates.back().parameters.transpose();
  }
  JointEstimate joint;
  if (options.estimator == Estimator::joint) {
    joint = estimate_joint(mechanism, measurements, result.parameters, options);
    result.parameters = joint.parameters;
  }
  std::vector<LegInfluence> influences;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const LegEstimate& estimate = estimates[static_cast<std::size_t>(leg)];
    const WhitenedClosures system = leg_system(result.parameters, leg);
    result.legs.push_back(describe(system, estimate));
    result.goodness.push_back(
        goodness_of_fit(system, estimate.loss_weights, mechanism.leg_count()));
    influences.push_back(influence_of(system, estimate, estimated[static_cast<std::size_t>(leg)],
                                      options.estimator));
  }
  if (options.estimator == Estimator::joint) {
    describe_joint(joint, mechanism, result);
  } else {
    const bool explained = std::none_of(result.goodness.begin(), result.goodness.end(),
                                        [](const GoodnessOfFit& fit) { return fit.unexplained(); });
    result.covariance = explained
                            ? declared_covariance(influences, mechanism.pose_space(), options.noise)
                            : residual_covariance(influences);
  }
  summarise(result);
  return result;
}

}  // namespace symkin
