// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

void keep_estimated(const LegData& data, ClosureRows& rows) {
  if (static_cast<Index>(data.estimated.size()) < rows.by_parameters.cols()) {
    rows.by_parameters = RowMatrix(rows.by_parameters(kAll, data.estimated));
  }
}

// Cholesky factor of the covariance of a leg's closures at one pose, m^2: H Sigma H' + b b'
// sigma_q^2, H their dh/dpose and b their dh/dpsi. NaN for derivatives that are not finite; empty
// where it is singular.
RowMatrix closure_factor(const RowMatrix& by_pose, const Vector& by_reading, PoseSpace space,
                         const MeasurementNoise& noise) {
  constexpr double kSingular = 1e-12;  // of a variance: what is left once the others are known
  RowMatrix covariance =
      product(by_pose * noise.pose_variances(space).asDiagonal(), by_pose.transpose());
  covariance += noise.reading * noise.reading * by_reading * by_reading.transpose();
  if (!covariance.allFinite()) {
    return RowMatrix::Constant(covariance.rows(), covariance.cols(),
                               std::numeric_limits<double>::quiet_NaN());
  }
  RowMatrix factor = cholesky_factor(covariance);
  const bool singular =
      factor.size() > 0 &&
      (factor.diagonal().array().square() < kSingular * covariance.diagonal().array()).any();
  return singular ? RowMatrix() : factor;
}

// L D L' = V, the covariance of the closures at each pose: rows become L^-1 of what they were, and
// D is returned. Where V is singular D is zero and the rows stay.
Vector decorrelate(ClosureRows& rows, Index closures, PoseSpace space,
                   const MeasurementNoise& noise) {
  Vector variances = Vector::Zero(rows.by_reading.size());
  for (Index first = 0; first < variances.size(); first += closures) {
    auto by_pose = rows.by_pose.middleRows(first, closures);
    auto by_reading = rows.by_reading.segment(first, closures);
    const RowMatrix factor = closure_factor(by_pose, by_reading, space, noise);
    if (factor.size() == 0) {
      continue;
    }
    const RowMatrix inverse = factor.diagonal().asDiagonal() * lower_inverse(factor);
    variances.segment(first, closures) = factor.diagonal().cwiseAbs2();
    by_pose = product(inverse, by_pose);
    by_reading = product(inverse, by_reading);
    rows.closure.segment(first, closures) = product(inverse, rows.closure.segment(first, closures));
    rows.by_parameters.middleRows(first, closures) =
        product(inverse, rows.by_parameters.middleRows(first, closures));
  }
  return variances;
}

}  // namespace

void linearise_closures(const LegData& data, const Vector& parameters, ClosureRows& rows) {
  data.model.linearise(parameters, data.poses, data.readings, rows);
  keep_estimated(data, rows);
}

void whiten(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
            WhitenedLeg& leg) {
  linearise_closures(data, parameters, leg.rows);
  const ChainInfo& chain = data.model.info();
  if (chain.closures == 1) {
    closure_variances(leg.rows, chain.pose_space, noise, leg.variances);
  } else {
    leg.variances = decorrelate(leg.rows, chain.closures, chain.pose_space, noise);
  }
  leg.factors = leg.variances.cwiseSqrt().cwiseInverse();
}

void linearise_readings(const LegData& data, const Vector& parameters, ClosureRows& rows) {
  Vector roots(data.readings.size());
  data.model.inverse_kinematics(parameters, data.working_mode, data.poses, roots);
  Vector errors(roots.size());
  data.model.reading_differences(parameters, roots, data.readings, errors);
  data.model.linearise(parameters, data.poses, data.readings + errors, rows);
  keep_estimated(data, rows);
  rows.by_parameters.array().colwise() /= -rows.by_reading.array();
  rows.closure = errors;
}

ReadingNoise reading_noise(const LegData& data, const Vector& parameters,
                           const MeasurementNoise& noise) {
  ClosureRows rows;
  data.model.linearise_pose(parameters, data.poses, data.readings, rows);
  const Vector variances = closure_variances(rows, data.model.info().pose_space, noise);
  const Vector deviations = (variances.array() / rows.by_reading.array().square()).sqrt();
  const double typical = std::sqrt(deviations.cwiseAbs2().mean());
  return {typical, deviations / typical};
}

HeldNoise hold_noise(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
                     bool in_readings) {
  const Index poses = data.readings.size();
  const ChainInfo& chain = data.model.info();
  if (in_readings) {
    // One factor for all poses: the cost stays the paper's.
    const auto [typical, relative] = reading_noise(data, parameters, noise);
    return {RowMatrix::Constant(poses, 1, 1 / typical), relative};
  }
  // The transform is what decorrelation makes of the unit matrix.
  ClosureRows rows;
  data.model.linearise(parameters, data.poses, data.readings, rows);
  rows.by_parameters = RowMatrix::Identity(chain.closures, chain.closures).replicate(poses, 1);
  const Vector variances = decorrelate(rows, chain.closures, chain.pose_space, noise);
  return {variances.cwiseSqrt().cwiseInverse().asDiagonal() * rows.by_parameters,
          Vector::Ones(poses)};
}

std::string unreached_pose(const Vector& errors) {
  Index row = 0;
  errors.array().isFinite().cast<int>().minCoeff(&row);
  return "measured pose " + std::to_string(row + 1);
}

std::string out_of_reach_at_start(const Vector& errors) {
  return unreached_pose(errors) + " is out of the leg's reach at the start";
}

Vector scaled_least_squares(const RowMatrix& a, const Vector& b) {
  const Vector scale = inverse_column_lengths(a);
  const ColumnSpace space = column_space(a * scale.asDiagonal());
  return scale.asDiagonal() * (space.coordinates * (space.basis.transpose() * b));
}

double relative_step(const LegData& data, const Vector& parameters, const Vector& step) {
  double largest = 0;
  for (Index i = 0; i < step.size(); ++i) {
    const double size = std::abs(parameters[data.estimated[static_cast<std::size_t>(i)]]);
    largest = std::max(largest, std::abs(step[i]) / std::max(size, 1.0));
  }
  return largest;
}

}  // namespace symkin
