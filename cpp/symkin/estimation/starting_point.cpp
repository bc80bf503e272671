// SPDX-License-Identifier: MIT
#include "symkin/estimation/starting_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "symkin/estimation/detail/closed_form_frames.hpp"
#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/kinematics/continuation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Poses of the setup's robot along its readings; NaN of one that hangs, which they do not tell.
RowMatrix continued_poses(const Mechanism& mechanism, const Setup& setup,
                          const Observations& observations, ConstVector home) {
  RowMatrix readings = observations.readings.values;
  if (mechanism.underdetermined()) {
    return RowMatrix::Constant(readings.rows(), coordinate_count(mechanism.pose_space()), kUnknown);
  }
  for (Index leg = 0; leg < readings.cols(); ++leg) {
    for (Index i = 0; i < readings.rows(); ++i) {
      readings(i, leg) = setup.model_reading(leg, readings(i, leg));
    }
  }
  return continued(mechanism.with_parameters(setup.parameters), readings, home);
}

// Poses whose every coordinate was observed, NaN otherwise.
RowMatrix complete_rows(const Observed& observed, Index count, Index coordinates) {
  RowMatrix rows = RowMatrix::Constant(count, coordinates, kUnknown);
  for (Index i = 0; observed.any() && i < count; ++i) {
    if (observed.values.row(i).allFinite()) {
      rows.row(i) = observed.values.row(i);
    }
  }
  return rows;
}

// Poses of the robot in its own frame, from what it says of itself.
RowMatrix robot_poses(const Mechanism& mechanism, const Setup& setup,
                      const Observations& observations, ConstVector home) {
  RowMatrix poses = complete_rows(observations.reported, observations.count(),
                                  coordinate_count(mechanism.pose_space()));
  if (poses.allFinite()) {
    return poses;
  }
  const RowMatrix computed = continued_poses(mechanism, setup, observations, home);
  for (Index i = 0; i < poses.rows(); ++i) {
    if (!poses.row(i).allFinite()) {
      poses.row(i) = computed.row(i);
    }
  }
  return poses;
}

// Pairs of poses that say where the frames are: what was seen and what the robot says of itself.
struct SeenPoses {
  std::vector<SeenPose> pairs;
  std::vector<Index> rows;
  RowMatrix robot;  // a row each of these
  bool all_turned = true;
};

SeenPoses seen_poses(const Mechanism& mechanism, const Setup& setup,
                     const Observations& observations, ConstVector home) {
  const PoseSpace space = mechanism.pose_space();
  const Index dimensions = position_size(space);
  const RowMatrix robot = robot_poses(mechanism, setup, observations, home);
  SeenPoses found;
  for (Index i = 0; observations.poses.any() && i < observations.count(); ++i) {
    const auto seen = observations.poses.values.row(i);
    if (!robot.row(i).allFinite() || !seen.head(dimensions).allFinite()) {
      continue;
    }
    const Index rest = seen.size() - dimensions;
    const bool turned = rest > 0 && seen.tail(rest).allFinite();
    if (dimensions == 0 && !turned) {
      continue;
    }
    Vector known = identity_pose(space);
    known.head(dimensions) = seen.head(dimensions);
    if (turned) {
      known = seen;
    }
    found.all_turned = found.all_turned && turned;
    found.pairs.push_back(
        {frame_of_pose(space, robot.row(i).data()), frame_of_pose(space, known.data())});
    found.rows.push_back(i);
  }
  found.robot = robot(found.rows, kAll);
  return found;
}

// A start needs no more poses than these, taken all over the measurements.
std::vector<Index> some_of(Index count) {
  constexpr Index kEnough = 40;
  std::vector<Index> some;
  for (Index k = 0; k < std::min(count, kEnough); ++k) {
    some.push_back(k * count / std::min(count, kEnough));
  }
  return some;
}

}  // namespace

RowMatrix starting_poses(const Mechanism& mechanism, const Setup& setup,
                         const Observations& observations, ConstVector home) {
  observations.check(mechanism, setup);
  const PoseSpace space = mechanism.pose_space();
  const Index count = observations.count();
  RowMatrix poses = complete_rows(observations.reported, count, coordinate_count(space));
  const RowMatrix seen = complete_rows(observations.poses, count, coordinate_count(space));
  const Frame from_device = setup.base.inverse();
  const Frame to_platform = setup.target.inverse();
  for (Index i = 0; i < count; ++i) {
    if (!poses.row(i).allFinite() && seen.row(i).allFinite()) {
      pose_of_frame(space, from_device * frame_of_pose(space, seen.row(i).data()) * to_platform,
                    poses.row(i).data());
    }
  }
  if (!poses.allFinite()) {
    const RowMatrix computed = continued_poses(mechanism, setup, observations, home);
    for (Index i = 0; i < count; ++i) {
      if (!poses.row(i).allFinite()) {
        poses.row(i) = computed.row(i);
      }
    }
  }
  return poses;
}

Setup with_starting_frames(const Mechanism& mechanism, const Setup& setup,
                           const Observations& observations, ConstVector home, bool base,
                           bool target) {
  constexpr std::size_t kLeast = 3;
  constexpr std::size_t kFew = 12;
  observations.check(mechanism, setup);
  const PoseSpace space = mechanism.pose_space();
  const Index dimensions = position_size(space);
  Observations used = observations.of(some_of(observations.count()));
  SeenPoses seen = seen_poses(mechanism, setup, used, home);
  if (seen.pairs.size() < kFew && used.count() < observations.count()) {
    used = observations;
    seen = seen_poses(mechanism, setup, used, home);
  }
  const auto& [pairs, rows, robot, all_turned] = seen;
  if (pairs.size() < kLeast) {
    throw InvalidInput("the frames need at least " + std::to_string(kLeast) + " poses whose " +
                       (dimensions > 0 ? "position" : "orientation") +
                       " was measured and that can be computed from the readings; there are " +
                       std::to_string(pairs.size()));
  }

  const std::vector<FramePair> starts =
      closed_form_frames(pairs, {setup.base, setup.target}, {space, all_turned, base, target});

  // Refined with the robot's poses as they are, every start; planar rotations stay planar.
  Observations alone;
  const auto count = static_cast<Index>(rows.size());
  alone.readings.values = RowMatrix::Constant(count, mechanism.leg_count(), kUnknown);
  alone.readings.deviations = RowMatrix::Zero(count, mechanism.leg_count());
  alone.poses = used.poses.of(rows);
  alone.reported = {robot, RowMatrix::Zero(count, mechanism.dof())};
  // The robot's poses are exact here, so what was measured of them cannot be.
  const double length = longest_length(mechanism, setup);
  for (Index k = 0; k < alone.poses.deviations.cols(); ++k) {
    const double loose = k < dimensions ? length : 1;
    alone.poses.deviations.col(k) = alone.poses.deviations.col(k).unaryExpr(
        [loose](double deviation) { return deviation == 0 ? loose : deviation; });
  }
  const UnknownList list(setup);
  Layout layout;
  layout.column.assign(static_cast<std::size_t>(list.size()), -1);
  Index columns = 0;
  for (const bool of_base : {true, false}) {
    for (const Index slot : frame_slots(space)) {
      const Index scalar = (of_base ? list.base() : list.target()) + slot;
      if (of_base ? base : target) {
        layout.column[static_cast<std::size_t>(scalar)] = columns++;
      }
    }
  }
  // Loose, for what the poses do not show, such as the turn of a target that is only a point.
  const Vector sizes = natural_sizes(mechanism, setup);
  layout.prior.resize(columns);
  for (Index i = 0; i < sizes.size(); ++i) {
    const Index column = layout.column[static_cast<std::size_t>(i)];
    if (column >= 0) {
      layout.prior[column] = 1e3 * sizes[i];
    }
  }
  if (base && target && shown_places(pairs).cols() < dimensions) {
    const auto measured = alone.poses.values.leftCols(dimensions).array().isFinite();
    const auto deviations = alone.poses.deviations.leftCols(dimensions).array();
    const double square = measured.select(deviations.square(), 0).sum() /
                          static_cast<double>(measured.count() * count);
    const double near = std::sqrt(square) / kHardlyTilted;
    for (Index axis = 0; axis < dimensions; ++axis) {
      layout.prior[layout.column[static_cast<std::size_t>(list.target() + axis)]] = near;
    }
  }
  // The fit goes on from there: last digits of a bad start are not worth waiting for.
  constexpr SolverOptions kBriefly{12};
  Setup best = setup;
  double least = std::numeric_limits<double>::infinity();
  for (const FramePair& start : starts) {
    Setup trial = setup;
    trial.base = start.base;
    trial.target = start.target;
    LatentProblem problem(mechanism, alone, layout, trial, alone.reported.values,
                          std::vector<bool>(rows.size(), false));
    minimise(problem, kBriefly);
    NormalEquations end;
    if (problem.linearise(end) && end.cost < least) {
      least = end.cost;
      best = problem.setup();
    }
  }
  return best;
}

}  // namespace symkin
