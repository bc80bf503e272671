// SPDX-License-Identifier: MIT
#include "symkin/estimation/identification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/information.hpp"
#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/estimation/joint.hpp"
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
                    PoseUse use) {
  std::vector<Index> rows = rows_of_leg(measurements, leg, use);
  const auto count = static_cast<Index>(rows.size());
  if (count < mechanism.parameter_count()) {
    throw InvalidInput("leg " + std::to_string(leg + 1) + " was measured at " +
                       std::to_string(count) + " poses; its " +
                       std::to_string(mechanism.parameter_count()) +
                       " parameters need at least as many");
  }
  LegData data{mechanism.model(), mechanism.leg(leg).working_mode, std::move(rows),
               RowMatrix(count, measurements.poses.cols()), Vector(count)};
  for (Index i = 0; i < count; ++i) {
    const Index row = data.rows[static_cast<std::size_t>(i)];
    data.poses.row(i) = measurements.poses.row(row);
    data.readings[i] = measurements.readings(row, leg);
  }
  return data;
}

// A leg's closures at some parameters, and over their standard deviations by the declared noise:
// the least-squares problem of the estimator `implicit`.
struct WhitenedLeg {
  ClosureRows rows;
  Vector variances;
  Vector residual;
  RowMatrix jacobian;  // by the parameters
};

WhitenedLeg whiten(const LegData& data, ConstVector parameters, const MeasurementNoise& noise) {
  const PoseSpace space = data.model.info().pose_space;
  WhitenedLeg leg;
  data.model.linearise(parameters, data.poses, data.readings, leg.rows);
  leg.variances = closure_variances(leg.rows, space, noise);
  for (Index k = 0; k < leg.variances.size(); ++k) {
    if (leg.variances[k] <= 0) {  // throws
      joint_closure_factor(leg.rows.by_pose.row(k), leg.rows.by_reading.segment(k, 1), 1, space,
                           noise, data.rows[static_cast<std::size_t>(k)]);
    }
  }
  const Vector factors = leg.variances.cwiseSqrt().cwiseInverse();
  leg.residual = leg.rows.closure.cwiseProduct(factors);
  leg.jacobian = factors.asDiagonal() * leg.rows.by_parameters;
  return leg;
}

// What the whitened closures of one leg show of its parameters.
struct LegSight {
  double condition;  // of the jacobian with columns of length one; infinite if it has no full rank
  RowMatrix unseen;  // p x (p - rank): combinations of parameters, in their own units
};

LegSight sight_of(const RowMatrix& jacobian, const Information& information) {
  constexpr double kRank = 1e-10;
  const Index p = jacobian.cols();
  if (information.clear()) {
    return {information.condition(), RowMatrix(p, 0)};
  }
  if (!jacobian.allFinite()) {
    return {std::numeric_limits<double>::infinity(), RowMatrix(p, 0)};
  }
  const Vector scale = inverse_column_lengths(jacobian);
  const RightSingular svd = right_singular(jacobian * scale.asDiagonal());
  const Vector& singular = svd.values;
  const Index rank = (singular.array() > kRank * singular[0]).count();
  const double condition =
      rank < p ? std::numeric_limits<double>::infinity() : singular[0] / singular[p - 1];
  return {condition, named_directions(svd.vectors.rightCols(p - rank), scale)};
}

void require_identifiable(const WhitenedLeg& whitened, Index leg) {
  const Information information(whitened.jacobian);
  if (information.clear()) {
    return;
  }
  const LegSight sight = sight_of(whitened.jacobian, information);
  if (sight.unseen.cols() > 0) {
    throw NotIdentifiable("the measurements of leg " + std::to_string(leg + 1) +
                              " do not show all of its " + std::to_string(sight.unseen.rows()) +
                              " parameters",
                          sight.unseen);
  }
}

// Residuals and their statistics at the estimate.
LegIdentification describe(const LegData& data, const WhitenedLeg& whitened,
                           const LegEstimate& estimate) {
  LegIdentification leg;
  leg.rows = data.rows;
  leg.residuals = whitened.rows.closure;
  leg.standardised = whitened.residual;
  for (std::size_t k = 0; k < data.rows.size(); ++k) {
    if (estimate.loss_weights[static_cast<Index>(k)] < kRejectedWeight) {
      leg.rejected.push_back(data.rows[k]);
    }
  }
  leg.converged = estimate.outcome.converged;
  leg.failure = estimate.outcome.failure;
  leg.iterations = estimate.outcome.iterations;
  leg.condition = sight_of(whitened.jacobian, Information(whitened.jacobian)).condition;
  if (leg.converged && !(leg.standardised.allFinite() && std::isfinite(leg.condition))) {
    leg.converged = false;
    leg.failure = "the parameters that it ended at do not determine the closures";
  }
  return leg;
}

// How the leg's estimate answers to errors of its closures, at the estimate.
LegInfluence influence_of(const LegData& data, const WhitenedLeg& whitened,
                          const LegEstimate& estimate, Estimator estimator) {
  const ClosureRows& rows = whitened.rows;
  // On h in the estimator's residual; the paper's is -h / (dh/dpsi).
  const bool in_readings = estimator == Estimator::paper || estimator == Estimator::inverse;
  const Vector factors =
      (in_readings ? rows.by_reading : Vector(whitened.variances.cwiseSqrt())).cwiseInverse();
  LegInfluence leg;
  leg.rows = data.rows;
  leg.influence = least_squares_influence(rows.by_parameters, factors, estimate.loss_weights);
  leg.by_pose = rows.by_pose;
  leg.variances = whitened.variances;
  constexpr double kLeast = 1e-6;  // of 1 - leverage; a pose without which nothing is known has 0
  const Vector leverages =
      rows.by_parameters.cwiseProduct(leg.influence.transpose()).rowwise().sum();
  leg.deleted = rows.closure.array() / (1 - leverages.array()).max(kLeast);
  return leg;
}

// All legs together, on poses measured in full.
JointFit joint_of(const Mechanism& mechanism, const MeasurementSet& measurements,
                  const RowMatrix& start, const IdentificationOptions& options) {
  const auto everywhere = [&](const RowMatrix& values, const Vector& deviations) {
    return Observed{values, deviations.transpose().replicate(values.rows(), 1)};
  };
  Observations observations;
  observations.readings =
      everywhere(measurements.readings,
                 Vector::Constant(mechanism.leg_count(), options.noise.reading));
  observations.poses =
      everywhere(measurements.poses,
                 options.noise.pose_variances(mechanism.pose_space()).cwiseSqrt());
  Setup setup = Setup::of(mechanism);
  setup.parameters = start;
  JointOptions how;
  how.loss = options.loss;
  how.max_iterations = options.max_iterations;
  how.start = measurements.poses;
  how.rows = false;
  return fit_jointly(mechanism, setup, observations, Layout::of_all_parameters(setup), how);
}

// Takes the statistics of the joint estimate in place of those of its start.
void describe_joint(const JointFit& joint, Identification& result) {
  result.goodness = {joint.goodness};
  result.covariance = joint.covariance;
  for (std::size_t i = 0; i < result.legs.size(); ++i) {
    LegIdentification& leg = result.legs[i];
    leg.converged = joint.converged;
    leg.failure = joint.failure;
    leg.iterations += joint.iterations;
    leg.rejected.clear();
    for (const Index row : leg.rows) {
      if (joint.loss_weights[row] < kRejectedWeight) {
        leg.rejected.push_back(row);
      }
    }
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
  std::vector<LegData> data;
  std::vector<LegEstimate> estimates;
  Identification result;
  result.parameters = mechanism.parameters();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Vector& start = mechanism.leg(leg).parameters;
    data.push_back(data_of_leg(mechanism, measurements, leg, options.use));
    require_identifiable(whiten(data.back(), start, options.noise), leg);
    estimates.push_back(options.estimator == Estimator::paper
                            ? estimate_paper(data.back(), start, options)
                            : estimate_whitened(data.back(), start, options));
    result.parameters.row(leg) = estimates.back().parameters.transpose();
  }
  JointFit joint;
  if (options.estimator == Estimator::joint) {
    joint = joint_of(mechanism, measurements, result.parameters, options);
    result.parameters = joint.setup.parameters;
  }
  std::vector<LegInfluence> influences;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const LegData& of_leg = data[static_cast<std::size_t>(leg)];
    const LegEstimate& estimate = estimates[static_cast<std::size_t>(leg)];
    const WhitenedLeg whitened =
        whiten(of_leg, result.parameters.row(leg).transpose(), options.noise);
    result.legs.push_back(describe(of_leg, whitened, estimate));
    result.goodness.push_back(goodness_of_fit(leg, whitened.residual, whitened.jacobian,
                                              estimate.loss_weights, mechanism.leg_count()));
    influences.push_back(influence_of(of_leg, whitened, estimate, options.estimator));
  }
  if (options.estimator == Estimator::joint) {
    describe_joint(joint, result);
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
