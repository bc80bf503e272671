// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_system.hpp"

#include <cmath>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

void keep_estimated(const LegData& data, ClosureRows& rows) {
  if (static_cast<Index>(data.estimated.size()) < rows.by_parameters.cols()) {
    rows.by_parameters = RowMatrix(rows.by_parameters(kAll, data.estimated));
  }
}

// Rows become what each closure of a pose says that those before it do not, so that their errors
// are independent, and their variances are returned: L^-1 of what they were, L D L' the covariance
// H Sigma H' + b b' sigma_q^2 of the closures, H their dh/dpose and b their dh/dpsi. Where that is
// singular the variances are zero.
Vector decorrelate(ClosureRows& rows, Index closures, PoseSpace space,
                   const MeasurementNoise& noise) {
  constexpr double kSingular = 1e-12;  // of a variance: what is left once the others are known
  const Vector of_pose = noise.pose_variances(space);
  const auto covariance = [&](Index a, Index b) {
    return rows.by_pose.row(a).cwiseProduct(rows.by_pose.row(b)).dot(of_pose.transpose()) +
           noise.reading * noise.reading * rows.by_reading[a] * rows.by_reading[b];
  };
  Vector variances(rows.by_reading.size());
  for (Index first = 0; first < variances.size(); first += closures) {
    for (Index i = first; i < first + closures; ++i) {
      const double all = covariance(i, i);
      for (Index before = first; before < i; ++before) {
        const double share = covariance(i, before) / variances[before];
        rows.closure[i] -= share * rows.closure[before];
        rows.by_parameters.row(i) -= share * rows.by_parameters.row(before);
        rows.by_pose.row(i) -= share * rows.by_pose.row(before);
        rows.by_reading[i] -= share * rows.by_reading[before];
      }
      variances[i] = covariance(i, i);
      if (variances[i] <= kSingular * all) {
        variances.segment(first, closures).setZero();
        break;
      }
    }
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

}  // namespace symkin
