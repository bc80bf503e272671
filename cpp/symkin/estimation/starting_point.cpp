// SPDX-License-Identifier: MIT
#include "symkin/estimation/starting_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "symkin/estimation/detail/closed_form_frames.hpp"
#include "symkin/estimation/detail/frames_of_poses.hpp"
#include "symkin/kinematics/continuation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr Index kBase = 0, kTarget = 6;  // first of the tangents of both frames

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
  return found;
}

// What is measured of them by its deviations. The robot's poses are exact here, so what was
// measured of them cannot be.
std::vector<WeighedPose> weighed_poses(const SeenPoses& seen, const Observed& measured,
                                       PoseSpace space, double longest) {
  const Index dimensions = position_size(space);
  const std::vector<Index>& slots = pose_slots(space);
  std::vector<WeighedPose> weighed;
  for (std::size_t i = 0; i < seen.rows.size(); ++i) {
    const Index row = seen.rows[i];
    const auto values = measured.values.row(row);
    const bool turned = values.tail(values.size() - dimensions).allFinite();
    WeighedPose pose{seen.pairs[i], Eigen::Matrix<double, 6, 6>::Zero()};
    for (Index k = 0; k < (turned ? degrees_of_freedom(space) : dimensions); ++k) {
      const double deviation = measured.deviations(row, k);
      const double loose = k < dimensions ? longest : 1;
      const Index slot = slots[static_cast<std::size_t>(k)];
      if (k < dimensions && measured.axes.cols() > 0) {
        pose.weights.row(slot).head<3>() = measured.axes.row(row).segment<3>(3 * k);
      } else {
        pose.weights(slot, slot) = 1;
      }
      pose.weights.row(slot) /= deviation == 0 ? loose : deviation;
    }
    weighed.push_back(pose);
  }
  return weighed;
}

// How near the target is to where it is taken to be, for tilts that hardly show it to tell.
double near_place(const std::vector<WeighedPose>& poses, Index dimensions) {
  double square = 0;
  for (const WeighedPose& pose : poses) {
    square += pose.weights.topRows(dimensions).rowwise().squaredNorm().cwiseInverse().mean();
  }
  return std::sqrt(square) / static_cast<double>(poses.size()) / kHardlyTilted;
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
  if (seen.pairs.size() < kLeast) {
    throw InvalidInput("the frames need at least " + std::to_string(kLeast) + " poses whose " +
                       (dimensions > 0 ? "position" : "orientation") +
                       " was measured and that can be computed from the readings; there are " +
                       std::to_string(seen.pairs.size()));
  }

  const std::vector<FramePair> starts = closed_form_frames(seen.pairs, {setup.base, setup.target},
                                                           {space, seen.all_turned, base, target});

  // Refined with the robot's poses as they are, every start; planar rotations stay planar.
  std::vector<Index> free;
  for (const Index first : {kBase, kTarget}) {
    for (const Index slot : frame_slots(space)) {
      if (first == kBase ? base : target) {
        free.push_back(first + slot);
      }
    }
  }
  const double longest = longest_length(mechanism, setup);
  const std::vector<WeighedPose> poses = weighed_poses(seen, used.poses, space, longest);
  Eigen::Matrix<double, 12, 1> every;
  every << Eigen::Vector3d::Constant(longest), Eigen::Vector3d::Ones(),
      Eigen::Vector3d::Constant(longest), Eigen::Vector3d::Ones();
  const Vector sizes = every(free);
  // Loose, for what the poses do not show, such as the turn of a target that is only a point.
  every *= 1e3;
  if (base && target && shown_places(seen.pairs).cols() < dimensions) {
    every.segment(kTarget, dimensions).setConstant(near_place(poses, dimensions));
  }
  const Vector priors = every(free);
  // The fit goes on from there: last digits of a bad start are not worth waiting for.
  constexpr SolverOptions kBriefly{12};
  Setup best = setup;
  double least = std::numeric_limits<double>::infinity();
  for (const FramePair& start : starts) {
    FramesOfPoses problem(poses, start, free, priors, sizes);
    minimise(problem, kBriefly);
    NormalEquations end;
    if (problem.linearise(end) && end.cost < least) {
      least = end.cost;
      best.base = problem.frames().base;
      best.target = problem.frames().target;
    }
  }
  return best;
}

}  // namespace symkin
