// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pose_recovery.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "symkin/estimation/joint.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// The poses that are not set aside, those with the nearest readings first, each leg's in its own
// range; without those that have no leg in common.
std::vector<Index> nearest_poses(const RowMatrix& readings, Index pose,
                                 const std::vector<bool>& aside) {
  Vector ranges(readings.cols());
  for (Index leg = 0; leg < readings.cols(); ++leg) {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (Index i = 0; i < readings.rows(); ++i) {
      if (std::isfinite(readings(i, leg))) {
        least = std::min(least, readings(i, leg));
        most = std::max(most, readings(i, leg));
      }
    }
    ranges[leg] = most > least ? most - least : 1;
  }
  std::vector<std::pair<double, Index>> distances;
  for (Index other = 0; other < readings.rows(); ++other) {
    if (aside[static_cast<std::size_t>(other)]) {
      continue;
    }
    double sum = 0;
    Index common = 0;
    for (Index leg = 0; leg < readings.cols(); ++leg) {
      const double way = (readings(other, leg) - readings(pose, leg)) / ranges[leg];
      if (std::isfinite(way)) {
        sum += way * way;
        ++common;
      }
    }
    if (common > 0) {
      distances.emplace_back(sum / static_cast<double>(common), other);
    }
  }
  std::sort(distances.begin(), distances.end());
  std::vector<Index> nearest;
  nearest.reserve(distances.size());
  for (const auto& [distance, other] : distances) {
    nearest.push_back(other);
  }
  return nearest;
}

Layout nothing_free(const Setup& setup) {
  return {std::vector<Index>(static_cast<std::size_t>(UnknownList(setup).size()), -1), Vector(0)};
}

// The pose that its own observations ask for with all else held, from `start`, and what they leave
// unexplained there; no pose if there is none.
struct Relaxed {
  RowMatrix pose;
  double cost = std::numeric_limits<double>::infinity();
};

Relaxed relaxed(const Mechanism& mechanism, const Observations& observations, const Setup& setup,
                Index pose, const RowMatrix& start) {
  constexpr int kMaxSteps = 50;
  constexpr double kStill = 1e-10;
  const Observations alone = observations.of({pose});
  const Layout held = nothing_free(setup);
  LatentProblem problem(mechanism, alone, held, setup, start, {false});
  NormalEquations equations;
  for (int step = 0; step < kMaxSteps; ++step) {
    if (!problem.linearise(equations)) {
      return {};
    }
    const RowMatrix before = problem.poses();
    const double cost = problem.chi_squares()[0];
    problem.step(Vector(0));
    if ((problem.poses() - before).lpNorm<Eigen::Infinity>() < kStill) {
      return {problem.poses(), cost};
    }
  }
  return {};
}

// The same in steps that a weak observation of where it is damps: where the observations hardly
// show a direction, whole steps leap across the bend of the others for ever. The place where it
// comes to rest serves to tell whether the noise explains them, not to linearise there.
Relaxed damped(const Mechanism& mechanism, const Observations& observations, const Setup& setup,
               Index pose, const RowMatrix& start) {
  constexpr int kMaxSteps = 1000;
  constexpr double kLargest = 0.01;  // m or rad
  constexpr double kShorter = 0.5;   // after a step that takes back the last one
  constexpr double kLonger = 1.2;
  constexpr double kStill = 1e-8;
  const Observations alone = observations.of({pose});
  if (alone.reported.any()) {
    return {};
  }
  const Layout held = nothing_free(setup);
  Observations here = alone;
  here.reported.values = start;
  double deviation = kLargest;
  RowMatrix last = RowMatrix::Zero(1, start.cols());
  NormalEquations equations;
  for (int step = 0; step < kMaxSteps; ++step) {
    here.reported.deviations = RowMatrix::Constant(1, mechanism.dof(), deviation);
    LatentProblem problem(mechanism, here, held, setup, here.reported.values, {false});
    if (!problem.linearise(equations)) {
      return {};
    }
    problem.step(Vector(0));
    const RowMatrix move = problem.poses() - here.reported.values;
    if (move.lpNorm<Eigen::Infinity>() < kStill) {
      return {problem.poses(), problem.chi_squares()[0]};  // damping costs nothing at rest
    }
    deviation =
        std::min(deviation * (move.cwiseProduct(last).sum() < 0 ? kShorter : kLonger), kLargest);
    last = move;
    here.reported.values = problem.poses();
  }
  return {};
}

// Of each leg that was read, the sign of dh/dq, its working mode; then that of det(dh/dpose) where
// it is square. Zero where there is none.
Vector aspect_of(const Mechanism& mechanism, const Observations& observations, const Setup& setup,
                 Index pose, const RowMatrix& at) {
  const Index legs = mechanism.leg_count();
  const Index closures = mechanism.closures();
  Vector signs = Vector::Zero(legs + 1);
  RowMatrix by_pose(legs * closures, mechanism.dof());
  bool all = by_pose.rows() == by_pose.cols();
  for (Index leg = 0; leg < legs; ++leg) {
    const double reading = observations.readings.values(pose, leg);
    if (!std::isfinite(reading)) {
      all = false;
      continue;
    }
    const LegModel& model = mechanism.model(leg);
    const Vector parameters = setup.parameters.row(leg);
    const Vector shown = Vector::Constant(1, setup.model_reading(leg, reading));
    ClosureRows rows;
    model.linearise_pose(parameters, at, shown, rows);
    signs[leg] = rows.by_reading[0] / model.sensor_gain(parameters, shown[0]) < 0 ? -1 : 1;
    by_pose.middleRows(leg * closures, closures) = rows.by_pose;
  }
  if (all) {
    signs[legs] = determinant(by_pose) < 0 ? -1 : 1;
  }
  return signs;
}

// What `relax` makes of a pose that is set aside, from those with near readings: where every leg
// keeps its working mode and all together their aspect. A missing reading leaves room for other
// solutions: the one that explains most counts.
template <typename Relax>
Relaxed from_neighbours(const Mechanism& mechanism, const Observations& observations,
                        const Setup& setup, const RowMatrix& poses, const std::vector<bool>& aside,
                        Index pose, Relax relax) {
  constexpr int kNeighbours = 8;
  Relaxed best;
  int tried = 0;
  for (const Index near : nearest_poses(observations.readings.values, pose, aside)) {
    if (tried++ == kNeighbours) {
      break;
    }
    const RowMatrix start = poses.row(near);
    Relaxed found = relax(mechanism, observations, setup, pose, start);
    if (!(found.cost < best.cost)) {
      continue;
    }
    const Vector here = aspect_of(mechanism, observations, setup, pose, found.pose);
    const Vector there = aspect_of(mechanism, observations, setup, near, start);
    if ((here.array() * there.array() >= 0).all()) {
      best = std::move(found);
    }
  }
  return best;
}

}  // namespace

Index take_in(const Mechanism& mechanism, const Observations& observations,
              LatentProblem& problem) {
  const std::vector<bool> aside = problem.aside();
  Index taken = 0;
  for (std::size_t k = 0; k < aside.size(); ++k) {
    if (!aside[k]) {
      continue;
    }
    const auto pose = static_cast<Index>(k);
    const Relaxed best = from_neighbours(mechanism, observations, problem.setup(), problem.poses(),
                                         aside, pose, relaxed);
    if (best.pose.size() > 0) {
      problem.take_in(pose, best.pose.data());
      ++taken;
    }
  }
  return taken;
}

double left_unexplained(const Mechanism& mechanism, const Setup& setup,
                        const Observations& observations, const RowMatrix& poses, Index pose) {
  observations.check(mechanism, setup);
  check_poses(mechanism, poses);
  if (poses.rows() != observations.count() || pose < 0 || pose >= poses.rows()) {
    throw InvalidInput("pose " + std::to_string(pose) + " of " + std::to_string(poses.rows()) +
                       " is asked for; observed are " + std::to_string(observations.count()));
  }
  std::vector<bool> aside;
  for (Index i = 0; i < poses.rows(); ++i) {
    aside.push_back(!poses.row(i).allFinite());
  }
  try {
    return from_neighbours(mechanism, observations, setup, poses, aside, pose, damped).cost;
  } catch (const Error&) {  // exact readings that contradict each other press on to a singular pose
    return std::numeric_limits<double>::infinity();
  }
}

}  // namespace symkin
