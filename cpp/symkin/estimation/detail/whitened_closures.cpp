// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/whitened_closures.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "symkin/model/pose_space.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

std::vector<WhitenedPose> poses_with_legs(const Mechanism& mechanism,
                                          const MeasurementSet& measurements,
                                          const std::vector<Index>& legs, PoseUse use,
                                          Index closures) {
  std::vector<std::vector<Index>> read(static_cast<std::size_t>(measurements.poses.rows()));
  std::vector<Index> rows;
  for (const Index leg : legs) {
    rows_of_leg(MeasuredRobot::of(mechanism, measurements), mechanism.leg_count(), leg, use, rows);
    for (const Index row : rows) {
      read[static_cast<std::size_t>(row)].push_back(leg);
    }
  }
  std::vector<WhitenedPose> poses;
  Index first = 0;
  for (std::size_t row = 0; row < read.size(); ++row) {
    if (!read[row].empty()) {
      poses.push_back({static_cast<Index>(row), std::move(read[row]), closures, first, {}});
      first += poses.back().count();
    }
  }
  return poses;
}

struct LikelyMeasurements {
  MeasurementSet at;
  RowMatrix pose_steps;     // N x dof, from the measured to these; 0 where no leg was read
  RowMatrix reading_steps;  // N x legs
};

LikelyMeasurements most_likely(const WhitenedClosures& system, PoseSpace space,
                               const MeasurementSet& measured, const MeasurementNoise& noise) {
  const Vector variances = noise.pose_variances(space);
  const double reading_variance = noise.reading * noise.reading;
  LikelyMeasurements likely{measured, RowMatrix::Zero(measured.poses.rows(), variances.size()),
                            RowMatrix::Zero(measured.readings.rows(), measured.readings.cols())};
  for (const WhitenedPose& pose : system.poses) {
    const auto factor = pose.factor.triangularView<Eigen::Lower>();
    const Vector multipliers =
        factor.transpose().solve(system.residual.segment(pose.first, pose.count()));
    Vector step = Vector::Zero(variances.size());
    for (std::size_t k = 0; k < pose.legs.size(); ++k) {
      const Index leg = pose.legs[k];
      const ClosureRows& rows = system.of_legs[static_cast<std::size_t>(system.position(leg))];
      const Index row = pose.row * pose.closures;
      const auto own = multipliers.segment(static_cast<Index>(k) * pose.closures, pose.closures);
      step -= rows.by_pose.middleRows(row, pose.closures).transpose() * own;
      likely.reading_steps(pose.row, leg) =
          -reading_variance * rows.by_reading.segment(row, pose.closures).dot(own);
    }
    likely.pose_steps.row(pose.row) = variances.cwiseProduct(step).transpose();
    move_pose(space, likely.pose_steps.row(pose.row).data(), likely.at.poses.row(pose.row).data());
  }
  likely.at.readings += likely.reading_steps;
  return likely;
}

// Residuals of a system that was linearised there, as those of what was measured.
void count_from_measured(const LikelyMeasurements& likely, WhitenedClosures& system) {
  for (const WhitenedPose& pose : system.poses) {
    Vector moved(pose.count());
    for (std::size_t k = 0; k < pose.legs.size(); ++k) {
      const Index leg = pose.legs[k];
      const ClosureRows& rows = system.of_legs[static_cast<std::size_t>(system.position(leg))];
      const Index row = pose.row * pose.closures;
      moved.segment(static_cast<Index>(k) * pose.closures, pose.closures) =
          rows.by_pose.middleRows(row, pose.closures) *
              likely.pose_steps.row(pose.row).transpose() +
          rows.by_reading.segment(row, pose.closures) * likely.reading_steps(pose.row, leg);
    }
    system.residual.segment(pose.first, pose.count()) -= lower_solution(pose.factor, moved);
  }
}

}  // namespace

Index WhitenedClosures::position(Index leg) const {
  return std::find(legs.begin(), legs.end(), leg) - legs.begin();
}

WhitenedClosures whiten_closures(const Mechanism& mechanism, const MeasurementSet& measurements,
                                 const std::vector<Index>& legs, PoseUse use,
                                 const MeasurementNoise& noise) {
  const PoseSpace space = mechanism.pose_space();
  const Index closures = mechanism.closures();
  WhitenedClosures system;
  system.legs = legs;
  system.columns = {0};
  system.poses = poses_with_legs(mechanism, measurements, legs, use, closures);
  for (const Index leg : legs) {
    mechanism.model(leg).linearise(mechanism.leg(leg).parameters, measurements.poses,
                                   measurements.readings.col(leg), system.of_legs.emplace_back());
    system.columns.push_back(system.columns.back() + mechanism.estimated_count(leg));
    system.estimated.push_back(mechanism.estimated_parameters(leg));
  }
  for (const WhitenedPose& pose : system.poses) {
    system.first.push_back(pose.first + pose.count());
  }
  system.residual.resize(system.rows());
  system.jacobian.setZero(system.rows(), system.columns.back());
  for (WhitenedPose& pose : system.poses) {
    check_interrupt();
    const Index count = pose.count();
    RowMatrix by_pose(count, degrees_of_freedom(space));
    Vector by_reading(count);
    for (Index k = 0; k < count; k += closures) {
      const Index which = pose.legs[static_cast<std::size_t>(k / closures)];
      const auto position = static_cast<std::size_t>(system.position(which));
      const ClosureRows& leg = system.of_legs[position];
      const std::vector<Index>& estimated = system.estimated[position];
      const Index row = pose.row * closures;
      by_pose.middleRows(k, closures) = leg.by_pose.middleRows(row, closures);
      by_reading.segment(k, closures) = leg.by_reading.segment(row, closures);
      system.residual.segment(pose.first + k, closures) = leg.closure.segment(row, closures);
      system.jacobian.block(pose.first + k, system.columns[position], closures,
                            static_cast<Index>(estimated.size())) =
          leg.by_parameters.middleRows(row, closures)(kAll, estimated);
    }
    pose.factor = joint_closure_factor(by_pose, by_reading, closures, space, noise, pose.row);
    system.residual.segment(pose.first, count) =
        lower_solution(pose.factor, system.residual.segment(pose.first, count));
    system.jacobian.middleRows(pose.first, count) =
        lower_solution(pose.factor, system.jacobian.middleRows(pose.first, count));
  }
  return system;
}

LikelySystem whiten_where_likely(const Mechanism& mechanism, const MeasurementSet& measurements,
                                 const std::vector<Index>& legs, const MeasurementNoise& noise) {
  const auto whitened = [&](const MeasurementSet& at) {
    return whiten_closures(mechanism, at, legs, PoseUse::all, noise);
  };
  LikelyMeasurements likely =
      most_likely(whitened(measurements), mechanism.pose_space(), measurements, noise);
  WhitenedClosures closures = whitened(likely.at);
  count_from_measured(likely, closures);
  return {std::move(likely.at), std::move(closures)};
}

std::vector<Index> all_legs(Index count) {
  std::vector<Index> legs(static_cast<std::size_t>(count));
  std::iota(legs.begin(), legs.end(), Index{0});
  return legs;
}

}  // namespace symkin
