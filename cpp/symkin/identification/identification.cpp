// SPDX-License-Identifier: MIT
#include "symkin/identification/identification.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "symkin/error.hpp"
#include "symkin/identification/covariance.hpp"
#include "symkin/identification/joint_estimator.hpp"
#include "symkin/identification/leg_estimators.hpp"

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
  if (count < mechanism.parameter_count()) {
    throw InvalidInput("leg " + std::to_string(leg + 1) + " was measured at " +
                       std::to_string(count) + " poses; its " +
                       std::to_string(mechanism.parameter_count()) +
                       " parameters need at least as many");
  }
  LegData data{mechanism.model(), mechanism.leg(leg).working_mode,
               RowMatrix(count, measurements.poses.cols()), Vector(count)};
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

// 99.9% quantile of chi-square over its degrees of freedom (Wilson and Hilferty).
double chi_square_quantile(Index degrees_of_freedom) {
  const auto n = static_cast<double>(degrees_of_freedom);
  const double spread = 2 / (9 * n);
  return n * std::pow(1 - spread + 3.0902323 * std::sqrt(spread), 3);
}

// Factor on the declared standard deviations.
double unexplained_spread(const LegIdentification& leg) {
  const Index n = leg.degrees_of_freedom;
  if (n < 1 || leg.chi_square <= chi_square_quantile(n)) {
    return 1;
  }
  return std::sqrt(leg.chi_square / static_cast<double>(n));
}

// Residuals and their statistics at the estimate.
LegIdentification describe(const LegData& data, const Vector& parameters,
                           const std::vector<Index>& rows, const Vector& loss_weights,
                           const IdentificationOptions& options, ClosureRows& linear,
                           Vector& deviations) {
  LegIdentification leg;
  leg.rows = rows;
  data.model.linearise(parameters, data.poses, data.readings, linear);
  deviations = closure_variances(linear, data.model.info().pose_space, options.noise).cwiseSqrt();
  leg.residuals = linear.closure;
  leg.standardised = linear.closure.cwiseQuotient(deviations);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (loss_weights[static_cast<Index>(i)] < 0.5) {
      leg.rejected.push_back(rows[i]);
    }
  }
  leg.chi_square = (loss_weights.array() >= 0.5).select(leg.standardised.array().square(), 0).sum();
  leg.degrees_of_freedom =
      static_cast<Index>(rows.size() - leg.rejected.size()) - static_cast<Index>(parameters.size());
  Eigen::MatrixXd scaled = deviations.cwiseInverse().asDiagonal() * linear.by_parameters;
  scaled.colwise().normalize();
  const Vector singular = Eigen::JacobiSVD<Eigen::MatrixXd>(scaled).singularValues();
  leg.condition = singular[0] / singular[singular.size() - 1];
  return leg;
}

// What multiplies h in the estimator's residual: the paper's is g - psi = -h / (dh/dpsi).
Vector residual_factors(Estimator estimator, const ClosureRows& linear, const Vector& deviations) {
  const bool in_readings = estimator == Estimator::paper || estimator == Estimator::inverse;
  return in_readings ? linear.by_reading.cwiseInverse() : deviations.cwiseInverse();
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
  std::vector<LegData> data;
  std::vector<LegEstimate> estimates;
  std::vector<std::vector<Index>> rows;
  Identification result;
  result.parameters = mechanism.parameters();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    rows.push_back(rows_of_leg(measurements, leg, options.use));
    data.push_back(data_of_leg(mechanism, measurements, leg, rows.back()));
    estimates.push_back(estimate_leg(data.back(), mechanism.leg(leg).parameters, options));
    result.parameters.row(leg) = estimates.back().parameters.transpose();
  }
  JointEstimate joint;
  if (options.estimator == Estimator::joint) {
    joint = estimate_joint(mechanism, measurements, result.parameters, options);
    result.parameters = joint.parameters;
  }
  std::vector<LegInfluence> influences;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Vector parameters = result.parameters.row(static_cast<Index>(i)).transpose();
    ClosureRows linear;
    Vector deviations;
    LegIdentification leg = describe(data[i], parameters, rows[i], estimates[i].loss_weights,
                                     options, linear, deviations);
    const bool is_joint = options.estimator == Estimator::joint;
    leg.converged = estimates[i].converged && (!is_joint || joint.outcome.converged);
    leg.failure = estimates[i].failure + joint.outcome.failure;
    leg.iterations = estimates[i].iterations + joint.outcome.iterations;
    influences.push_back(
        {rows[i],
         least_squares_influence(linear.by_parameters,
                                 residual_factors(options.estimator, linear, deviations),
                                 estimates[i].loss_weights),
         linear.by_pose, linear.by_reading, unexplained_spread(leg)});
    result.legs.push_back(std::move(leg));
  }
  if (options.estimator == Estimator::joint) {
    const Index p = mechanism.parameter_count();
    Vector spread(mechanism.leg_count() * p);
    for (std::size_t i = 0; i < influences.size(); ++i) {
      spread.segment(static_cast<Index>(i) * p, p).setConstant(influences[i].spread);
    }
    result.covariance = spread.asDiagonal() * joint.covariance * spread.asDiagonal();
  } else {
    result.covariance = combined_covariance(influences, mechanism.pose_space(), options.noise);
  }
  summarise(result);
  return result;
}

}  // namespace symkin
