// SPDX-License-Identifier: MIT
#include "symkin/estimation/identification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/identifier.hpp"
#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/estimation/detail/pose_elimination.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"

namespace symkin {
namespace {

void check_measurements(const Mechanism& mechanism, const MeasurementSet& measurements) {
  MeasuredRobot::of(mechanism, measurements);
  if (!measurements.poses.allFinite()) {
    throw InvalidInput("a measured pose is not finite");
  }
}

// The poses and readings that the leg uses.
void take_data(const Mechanism& mechanism, const MeasurementSet& measurements, Index leg,
               PoseUse use, LegData& data) {
  rows_of_leg(MeasuredRobot::of(mechanism, measurements), mechanism.leg_count(), leg, use,
              data.rows);
  const auto count = static_cast<Index>(data.rows.size());
  if (count * mechanism.closures() < mechanism.estimated_count(leg)) {
    throw InvalidInput(
        "leg " + std::to_string(leg + 1) + " was measured at " + std::to_string(count) +
        " poses; its " + std::to_string(mechanism.estimated_count(leg)) +
        " parameters need at least as many" + (mechanism.closures() == 1 ? "" : " closures"));
  }
  data.poses.resize(count, measurements.poses.cols());
  data.readings.resize(count);
  for (Index i = 0; i < count; ++i) {
    const Index row = data.rows[static_cast<std::size_t>(i)];
    data.poses.row(i) = measurements.poses.row(row);
    data.readings[i] = measurements.readings(row, leg);
  }
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
  const Index closures = data.model.info().closures;
  for (std::size_t k = 0; k < data.rows.size(); ++k) {
    if (leg.variances[static_cast<Index>(k) * closures] <= 0) {
      throw_singular(data.rows[k], noise.reading == 0 && closures > leg.rows.by_pose.cols());
    }
  }
}

void require_identifiable(const LegData& data, const WhitenedLeg& whitened, Index leg) {
  const LinearFit linear(whitened.rows.by_parameters, whitened.factors);
  if (linear.unseen().cols() > 0) {
    RowMatrix unseen = RowMatrix::Zero(data.model.parameter_count(), linear.unseen().cols());
    unseen(data.estimated, kAll) = linear.named_unseen();
    throw NotIdentifiable("the measurements of leg " + std::to_string(leg + 1) +
                              " do not show all of its " + std::to_string(data.estimated.size()) +
                              " parameters",
                          unseen);
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
void describe_leg(const LegData& data, const LegEstimate& estimate, ConstVector parameters,
                  const LinearFit& linear, bool condition, LegIdentification& leg) {
  leg.rows = data.rows;
  leg.residuals = closures_of(data, estimate, parameters);
  leg.standardised = estimate.whitened.rows.closure.cwiseProduct(estimate.whitened.factors);
  const Index closures = data.model.info().closures;
  leg.rejected.clear();
  for (std::size_t k = 0; k < data.rows.size(); ++k) {
    if (estimate.loss_weights[static_cast<Index>(k) * closures] < kRejectedWeight) {
      leg.rejected.push_back(data.rows[k]);
    }
  }
  leg.converged = estimate.outcome.converged;
  leg.failure = estimate.outcome.failure;
  leg.iterations = estimate.outcome.iterations;
  leg.student_degrees = estimate.robust.student_degrees;
  leg.unguarded = estimate.unguarded;
  leg.condition =
      condition || !linear.clear() ? linear.condition() : std::numeric_limits<double>::quiet_NaN();
  if (leg.converged && !(leg.standardised.allFinite() && !std::isinf(leg.condition))) {
    leg.converged = false;
    leg.failure = "the parameters that it ended at do not determine the closures";
  }
}

GoodnessOfFit goodness_of(const LegIdentification& leg, const LegEstimate& estimate,
                          const LinearFit& linear, const RobustLoss& loss, Index number,
                          Index legs) {
  return loss.any()
             ? judged({number}, estimate.robust.chi_square, estimate.robust.degrees_of_freedom,
                      legs)
             : goodness_of_fit(number, leg.standardised, linear, leg.standardised.size(), legs);
}

// What robust_statistics() makes of the covariance, written as an influence: in place of the
// weights their roots, so that errors of the declared variances give W^-1 (of `implicit`), times
// its factor.
void follow_weights(const LegEstimate& estimate, LegInfluence& leg) {
  for (Index k = 0; k < leg.influence.cols(); ++k) {
    const double weight = estimate.loss_weights[k];
    leg.influence.col(k) *= weight > 0 ? std::sqrt(estimate.robust.variance / weight) : 0;
  }
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
  const RowMatrix influence =
      LinearFit(rows.by_parameters, factors.cwiseProduct(estimate.loss_weights.cwiseSqrt()))
          .influence();
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
    const RowMatrix open = RowMatrix::Identity(closures, closures) * (1 + kLeast) -
                           product(rows.by_parameters.middleRows(first, closures),
                                   influence.middleCols(first, closures));
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

// All legs together, on poses measured in full.
JointFit joint_of(const Mechanism& mechanism, const MeasurementSet& measurements,
                  const RowMatrix& start, const IdentificationOptions& options) {
  const Observations observations =
      Observations::in_full(mechanism.pose_space(), measurements, options.noise);
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
  columns.reserve(static_cast<std::size_t>(joint.covariance.rows()));
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
    leg.student_degrees = joint.student_degrees;
    leg.unguarded = joint.unguarded;
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
  result.residual_max = 0;
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
  if (estimator == Estimator::paper && loss.any()) {
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

Identifier::Identifier(const Mechanism& mechanism, const IdentificationOptions& options)
    : mechanism_(mechanism), options_(options) {
  const auto legs = static_cast<std::size_t>(mechanism.leg_count());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    data_.push_back({mechanism.model(leg),
                     mechanism.leg(leg).working_mode,
                     {},
                     {},
                     {},
                     mechanism.estimated_parameters(leg)});
  }
  estimates_.resize(legs);
  seen_.resize(legs);
  result_.legs.resize(legs);
}

void Identifier::estimate(std::size_t leg) {
  const auto number = static_cast<Index>(leg);
  LegData& data = data_[leg];
  LegEstimate& estimate = estimates_[leg];
  const Vector& start = mechanism_.leg(number).parameters;
  whiten(data, start, options_.noise, estimate.whitened);
  require_variances(data, estimate.whitened, options_.noise);
  require_identifiable(data, estimate.whitened, number);
  estimate = options_.estimator == Estimator::paper
                 ? estimate_paper(data, start, options_)
                 : estimate_leg(data, number, start, std::move(estimate.whitened), options_);
}

void Identifier::describe(std::size_t leg) {
  const LegEstimate& estimate = estimates_[leg];
  const WhitenedLeg& whitened = estimate.whitened;
  seen_[leg].reset(whitened.rows.by_parameters, whitened.factors);
  const auto number = static_cast<Index>(leg);
  describe_leg(data_[leg], estimate, result_.parameters.row(number).transpose(), seen_[leg],
               options_.conditions, result_.legs[leg]);
  if (options_.estimator != Estimator::joint) {
    result_.goodness.push_back(goodness_of(result_.legs[leg], estimate, seen_[leg], options_.loss,
                                           number, mechanism_.leg_count()));
  }
}

void Identifier::estimate_jointly(const MeasurementSet& measurements) {
  const JointFit joint = joint_of(mechanism_, measurements, result_.parameters, options_);
  result_.parameters = joint.setup.parameters;
  for (std::size_t leg = 0; leg < data_.size(); ++leg) {
    const LegData& data = data_[leg];
    const Vector parameters = result_.parameters.row(static_cast<Index>(leg)).transpose();
    if (options_.conditions) {
      whiten(data, parameters, options_.noise, estimates_[leg].whitened);
      describe(leg);
      continue;
    }
    LegIdentification& found = result_.legs[leg];
    found.rows = data.rows;
    found.iterations = estimates_[leg].outcome.iterations;
    found.residuals.resize(data.readings.size() * mechanism_.closures());
    data.model.closure(parameters, data.poses, data.readings, found.residuals);
  }
  describe_joint(joint, data_, result_);
}

Identification& Identifier::identify(const MeasurementSet& measurements, const RowMatrix& start) {
  check_measurements(mechanism_, measurements);
  check_estimator(mechanism_.model(0).info(), options_.estimator);
  const bool joint = options_.estimator == Estimator::joint;
  result_.parameters.resize(mechanism_.leg_count(), mechanism_.parameter_count());
  result_.goodness.clear();
  for (std::size_t leg = 0; leg < data_.size(); ++leg) {
    const auto number = static_cast<Index>(leg);
    take_data(mechanism_, measurements, number, options_.use, data_[leg]);
    if (start.size() > 0) {
      estimates_[leg].outcome = {};
      estimates_[leg].parameters = start.row(number).transpose();
      estimates_[leg].loss_weights.setOnes(data_[leg].readings.size() * mechanism_.closures());
    } else {
      estimate(leg);
    }
    result_.parameters.row(number) = estimates_[leg].parameters.transpose();
    if (!joint) {
      describe(leg);
    }
  }
  if (joint) {
    estimate_jointly(measurements);
  }
  summarise(result_);
  return result_;
}

bool Identifier::explained() const {
  return std::none_of(result_.goodness.begin(), result_.goodness.end(),
                      [](const GoodnessOfFit& fit) { return fit.unexplained(); });
}

RowMatrix Identifier::covariance_by_influence() const {
  std::vector<LegInfluence> influences;
  for (std::size_t i = 0; i < data_.size(); ++i) {
    influences.push_back(influence_of(data_[i], estimates_[i], options_.estimator));
  }
  if (options_.loss.any()) {
    for (std::size_t i = 0; i < data_.size(); ++i) {
      follow_weights(estimates_[i], influences[i]);
    }
  }
  return explained() || options_.loss.any()
             ? declared_covariance(influences, mechanism_.pose_space(), options_.noise)
             : residual_covariance(influences);
}

RowMatrix Identifier::covariance() const {
  if (options_.estimator == Estimator::joint) {
    return result_.covariance;
  }
  if (!explained() || options_.estimator != Estimator::implicit || options_.loss.any()) {
    return covariance_by_influence();
  }
  // Each leg's information is the inverse of its covariance, and the legs' errors are independent
  // but for those of poses that they share.
  const Index p = mechanism_.parameter_count();
  const Index size = result_.parameters.size();
  RowMatrix covariance =
      share_poses(data_) ? covariance_by_influence() : RowMatrix(RowMatrix::Zero(size, size));
  for (std::size_t leg = 0; leg < data_.size(); ++leg) {
    const Index first = static_cast<Index>(leg) * p;
    covariance.block(first, first, p, p)(data_[leg].estimated, data_[leg].estimated) =
        seen_[leg].covariance();
  }
  return covariance;
}

Identification identify(const Mechanism& mechanism, const MeasurementSet& measurements,
                        const IdentificationOptions& options) {
  options.check();
  Identifier identifier(mechanism, options);
  check_measurements(mechanism, measurements);
  Identification& found =
      identifier.identify(measurements, options.estimator == Estimator::joint
                                            ? joint_start(mechanism, measurements, options)
                                            : RowMatrix());
  found.covariance = identifier.covariance();
  return std::move(found);
}

}  // namespace symkin
