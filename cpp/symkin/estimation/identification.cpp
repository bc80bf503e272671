// SPDX-License-Identifier: MIT
#include "symkin/estimation/identification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/information.hpp"
#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"

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
  if (count * mechanism.closures() < mechanism.estimated_count(leg)) {
    throw InvalidInput(
        "leg " + std::to_string(leg + 1) + " was measured at " + std::to_string(count) +
        " poses; its " + std::to_string(mechanism.estimated_count(leg)) +
        " parameters need at least as many" + (mechanism.closures() == 1 ? "" : " closures"));
  }
  LegData data{mechanism.model(leg), mechanism.leg(leg).working_mode,
               std::move(rows),      RowMatrix(count, measurements.poses.cols()),
               Vector(count),        mechanism.estimated_parameters(leg)};
  for (Index i = 0; i < count; ++i) {
    const Index row = data.rows[static_cast<std::size_t>(i)];
    data.poses.row(i) = measurements.poses.row(row);
    data.readings[i] = measurements.readings(row, leg);
  }
  return data;
}

void check_estimator(const ChainInfo& chain, Estimator estimator) {
  if (chain.closures > 1 && (estimator == Estimator::paper || estimator == Estimator::inverse)) {
    throw InvalidInput(
        "the estimators \"paper\" and \"inverse\" know legs by their readings alone; "
        "those of chain " +
        std::string(chain.name) + " have " + std::to_string(chain.closures) +
        " closures: use \"implicit\" or \"joint\"");
  }
}

// Throws where a closure has no variance, naming the pose.
void require_variances(const LegData& data, const WhitenedLeg& leg, const MeasurementNoise& noise) {
  for (Index k = 0; k < leg.variances.size(); ++k) {
    if (leg.variances[k] <= 0) {
      joint_closure_factor(leg.rows.by_pose.row(k), leg.rows.by_reading.segment(k, 1), 1,
                           data.model.info().pose_space, noise,
                           data.rows[static_cast<std::size_t>(k / data.model.info().closures)]);
    }
  }
}

void require_identifiable(const LegData& data, const WhitenedLeg& whitened, Index leg) {
  const Information information(whitened.rows.by_parameters, whitened.factors);
  if (information.clear()) {
    return;
  }
  const RowMatrix combinations = information.sight().unseen;
  if (combinations.cols() > 0) {
    RowMatrix unseen = RowMatrix::Zero(data.model.parameter_count(), combinations.cols());
    unseen(data.estimated, kAll) = combinations;
    throw NotIdentifiable("the measurements of leg " + std::to_string(leg + 1) +
                              " do not show all of its " + std::to_string(data.estimated.size()) +
                              " parameters",
                          unseen);
  }
}

LegEstimate estimate_leg(const LegData& data, Index leg, const Vector& start,
                         const IdentificationOptions& options) {
  WhitenedLeg whitened;
  whiten(data, start, options.noise, whitened);
  require_variances(data, whitened, options.noise);
  require_identifiable(data, whitened, leg);
  switch (options.estimator) {
    case Estimator::paper:
      return estimate_paper(data, start, options);
    case Estimator::inverse:
      return estimate_inverse(data, start, options);
    default:
      return estimate_implicit(data, start, std::move(whitened), options);
  }
}

// Closures as they are, which were whitened in place where a pose has several.
Vector closures_of(const LegData& data, const LegEstimate& estimate, ConstVector parameters) {
  if (data.model.info().closures == 1) {
    return estimate.whitened.rows.closure;
  }
  Vector values(estimate.whitened.rows.closure.size());
  data.model.closure(parameters, data.poses, data.readings, values);
  return values;
}

// Residuals at the estimate.
LegIdentification describe(const LegData& data, const LegEstimate& estimate, ConstVector parameters,
                           const Information& information, bool condition) {
  LegIdentification leg;
  leg.rows = data.rows;
  leg.residuals = closures_of(data, estimate, parameters);
  leg.standardised = estimate.whitened.rows.closure.cwiseProduct(estimate.whitened.factors);
  const Index closures = data.model.info().closures;
  for (std::size_t k = 0; k < data.rows.size(); ++k) {
    if (estimate.loss_weights[static_cast<Index>(k) * closures] < kRejectedWeight) {
      leg.rejected.push_back(data.rows[k]);
    }
  }
  leg.converged = estimate.outcome.converged;
  leg.failure = estimate.outcome.failure;
  leg.iterations = estimate.outcome.iterations;
  leg.condition = condition || !information.clear() ? information.sight().condition
                                                    : std::numeric_limits<double>::quiet_NaN();
  if (leg.converged && !(leg.standardised.allFinite() && !std::isinf(leg.condition))) {
    leg.converged = false;
    leg.failure = "the parameters that it ended at do not determine the closures";
  }
  return leg;
}

// Of the poses that the loss keeps.
GoodnessOfFit goodness_of(const LegIdentification& leg, const LegEstimate& estimate,
                          const Information& information, Index number, Index legs) {
  const Index count = leg.standardised.size();
  const Index closures = count / std::max<Index>(static_cast<Index>(leg.rows.size()), 1);
  const Index rejected = static_cast<Index>(leg.rejected.size()) * closures;
  if (rejected == 0) {
    return goodness_of_fit(number, leg.standardised, information, count, legs);
  }
  const Vector kept = (estimate.loss_weights.array() >= kRejectedWeight).cast<double>();
  return goodness_of_fit(number, kept.cwiseProduct(leg.standardised),
                         Information(estimate.whitened.rows.by_parameters,
                                     kept.cwiseProduct(estimate.whitened.factors)),
                         count - rejected, legs);
}

// How the leg's estimate answers to errors of its closures, at the estimate.
LegInfluence influence_of(const LegData& data, const LegEstimate& estimate, Estimator estimator) {
  const WhitenedLeg& whitened = estimate.whitened;
  const ClosureRows& rows = whitened.rows;
  // On h in the estimator's residual; the paper's is -h / (dh/dpsi).
  const bool in_readings = estimator == Estimator::paper || estimator == Estimator::inverse;
  const Vector factors = in_readings ? Vector(rows.by_reading.cwiseInverse()) : whitened.factors;
  LegInfluence leg;
  const Index closures = data.model.info().closures;
  for (const Index row : data.rows) {
    leg.rows.insert(leg.rows.end(), static_cast<std::size_t>(closures), row);
  }
  const RowMatrix influence = least_squares_influence(
      rows.by_parameters, factors.cwiseProduct(estimate.loss_weights.cwiseSqrt()));
  leg.influence = RowMatrix::Zero(estimate.parameters.size(), influence.cols());
  leg.influence(data.estimated, kAll) = influence;
  leg.by_pose = rows.by_pose;
  leg.variances = whitened.variances;
  constexpr double kLeast = 1e-6;  // of 1 - leverage; a pose without which nothing is known has 0
  if (closures == 1) {
    const Vector leverages = rows.by_parameters.cwiseProduct(influence.transpose()).rowwise().sum();
    leg.deleted = rows.closure.array() / (1 - leverages.array()).max(kLeast);
    return leg;
  }
  leg.deleted.resize(rows.closure.size());
  for (Index first = 0; first < leg.deleted.size(); first += closures) {
    const Eigen::MatrixXd open =
        Eigen::MatrixXd::Identity(closures, closures) * (1 + kLeast) -
        rows.by_parameters.middleRows(first, closures) * influence.middleCols(first, closures);
    leg.deleted.segment(first, closures) = solution(open, rows.closure.segment(first, closures));
  }
  return leg;
}

bool share_poses(const std::vector<LegData>& legs) {
  std::vector<bool> used;
  for (const LegData& leg : legs) {
    for (const Index row : leg.rows) {
      const auto place = static_cast<std::size_t>(row);
      used.resize(std::max(used.size(), place + 1));
      if (used[place]) {
        return true;
      }
      used[place] = true;
    }
  }
  return false;
}

RowMatrix covariance_of(const std::vector<LegData>& data, const std::vector<LegEstimate>& estimates,
                        const std::vector<Information>& seen, bool explained,
                        const IdentificationOptions& options) {
  const bool by_variances =
      options.estimator == Estimator::implicit &&
      std::all_of(estimates.begin(), estimates.end(), [](const LegEstimate& estimate) {
        return (estimate.loss_weights.array() == 1).all();
      });
  if (explained && by_variances && !share_poses(data)) {
    // The legs' errors are independent, and their informations say all.
    const Index p = estimates.front().parameters.size();
    const auto count = static_cast<Index>(data.size());
    RowMatrix covariance = RowMatrix::Zero(count * p, count * p);
    for (Index leg = 0; leg < count; ++leg) {
      const auto i = static_cast<std::size_t>(leg);
      covariance.block(leg * p, leg * p, p, p)(data[i].estimated, data[i].estimated) =
          seen[i].inverse();
    }
    return covariance;
  }
  std::vector<LegInfluence> influences;
  for (std::size_t i = 0; i < data.size(); ++i) {
    influences.push_back(influence_of(data[i], estimates[i], options.estimator));
  }
  const PoseSpace space = data.front().model.info().pose_space;
  return explained ? declared_covariance(influences, space, options.noise)
                   : residual_covariance(influences);
}

// All legs together, on poses measured in full.
JointFit joint_of(const Mechanism& mechanism, const MeasurementSet& measurements,
                  const RowMatrix& start, const IdentificationOptions& options) {
  const auto everywhere = [&](const RowMatrix& values, const Vector& deviations) {
    return Observed{values, deviations.transpose().replicate(values.rows(), 1)};
  };
  Observations observations;
  observations.readings = everywhere(
      measurements.readings, Vector::Constant(mechanism.leg_count(), options.noise.reading));
  observations.poses = everywhere(measurements.poses,
                                  options.noise.pose_variances(mechanism.pose_space()).cwiseSqrt());
  Setup setup = Setup::of(mechanism);
  setup.parameters = start;
  JointOptions how;
  how.loss = options.loss;
  how.max_iterations = options.max_iterations;
  how.start = measurements.poses;
  how.rows = false;
  return fit_jointly(mechanism, setup, observations, Layout::of_all_parameters(mechanism, setup),
                     how);
}

// Takes the statistics of the joint estimate in place of those of its start.
void describe_joint(const JointFit& joint, const std::vector<LegData>& data,
                    Identification& result) {
  result.goodness = {joint.goodness};
  std::vector<Index> columns;
  for (std::size_t leg = 0; leg < data.size(); ++leg) {
    for (const Index i : data[leg].estimated) {
      columns.push_back(static_cast<Index>(leg) * result.parameters.cols() + i);
    }
  }
  result.covariance = RowMatrix::Zero(result.parameters.size(), result.parameters.size());
  result.covariance(columns, columns) = joint.covariance;
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
  check_measurements(mechanism, measurements);
  check_estimator(mechanism.model(0).info(), options.estimator);
  std::vector<LegData> data;
  std::vector<LegEstimate> estimates;
  Identification result;
  result.parameters = mechanism.parameters();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    data.push_back(data_of_leg(mechanism, measurements, leg, options.use));
    const Vector& start = mechanism.leg(leg).parameters;
    estimates.push_back(estimate_leg(data.back(), leg, start, options));
    result.parameters.row(leg) = estimates.back().parameters.transpose();
  }
  JointFit joint;
  if (options.estimator == Estimator::joint) {
    joint = joint_of(mechanism, measurements, result.parameters, options);
    result.parameters = joint.setup.parameters;
    for (std::size_t leg = 0; leg < data.size(); ++leg) {
      whiten(data[leg], result.parameters.row(static_cast<Index>(leg)).transpose(), options.noise,
             estimates[leg].whitened);
    }
  }
  std::vector<Information> seen;
  seen.reserve(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) {
    const WhitenedLeg& whitened = estimates[i].whitened;
    seen.emplace_back(whitened.rows.by_parameters, whitened.factors);
    result.legs.push_back(describe(data[i], estimates[i],
                                   result.parameters.row(static_cast<Index>(i)).transpose(),
                                   seen[i], options.conditions));
    result.goodness.push_back(goodness_of(result.legs[i], estimates[i], seen[i],
                                          static_cast<Index>(i), mechanism.leg_count()));
  }
  if (options.estimator == Estimator::joint) {
    describe_joint(joint, data, result);
  } else {
    const bool explained = std::none_of(result.goodness.begin(), result.goodness.end(),
                                        [](const GoodnessOfFit& fit) { return fit.unexplained(); });
    result.covariance = covariance_of(data, estimates, seen, explained, options);
  }
  summarise(result);
  return result;
}

}  // namespace symkin
