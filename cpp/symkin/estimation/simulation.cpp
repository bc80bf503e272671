// SPDX-License-Identifier: MIT
#include "symkin/estimation/simulation.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

// Streams of the one seed, so that what is drawn for one purpose does not move another.
enum Stream : std::uint64_t { kParameters = 1, kMeasurements = 2 };

// Where the robot goes. Gravity decides what legs leave open: a platform that hangs is where it was
// sent, and its legs are as long as they are there.
ForwardKinematicsResult taken_by(const Mechanism& actual, const RowMatrix& commanded,
                                 ConstRows poses, RowMatrix& readings) {
  if (!actual.underdetermined()) {
    readings = commanded;
    return forward_kinematics(actual, commanded, poses);
  }
  readings = inverse_kinematics(actual, poses);
  ForwardKinematicsResult taken;
  taken.poses = poses;
  taken.status.assign(static_cast<std::size_t>(poses.rows()), ForwardStatus::converged);
  return taken;
}

void add_noise(const Mechanism& mechanism, const MeasurementNoise& noise, Random& random,
               Rows poses, Rows readings) {
  const PoseSpace space = mechanism.pose_space();
  const Vector deviations = noise.pose_variances(space).cwiseSqrt();
  Vector step(deviations.size());
  for (Index i = 0; i < poses.rows(); ++i) {
    for (Index k = 0; k < step.size(); ++k) {
      step[k] = deviations[k] * random.normal();
    }
    move_pose(space, step.data(), poses.row(i).data());
    for (Index leg = 0; leg < readings.cols(); ++leg) {
      if (mechanism.model(leg).info().read) {
        readings(i, leg) += noise.reading * random.normal();
      }
    }
  }
}

// What the sensors show at the poses taken. With more legs than degrees of freedom the commanded
// readings of a mechanism with errors contradict each other: the motors yield, and the sensors show
// what the pose leaves them (NaN where a leg cannot reach it).
RowMatrix sensed(const Mechanism& actual, const ForwardKinematicsResult& taken,
                 const RowMatrix& commanded) {
  if (!actual.redundant()) {
    return commanded;
  }
  RowMatrix readings = commanded;
  for (Index i = 0; i < readings.rows(); ++i) {
    if (taken.status[static_cast<std::size_t>(i)] == ForwardStatus::converged) {
      readings.row(i) = inverse_kinematics(actual, taken.poses.row(i));
    }
  }
  return readings;
}

RowMatrix told_joints(const Mechanism& model, const PoseSet& set) {
  return set.readings.size() == 0 ? inverse_kinematics(model, set.poses) : set.readings;
}

void check_set(const Mechanism& mechanism, const PoseSet& set, std::size_t number) {
  const std::string where = "pose set " + std::to_string(number);
  if (set.leg < -1 || set.leg >= mechanism.leg_count()) {
    throw InvalidInput(where + " is for leg " + std::to_string(set.leg) + "; expected 0 to " +
                       std::to_string(mechanism.leg_count() - 1) + ", or -1 for all");
  }
  if (set.wanted < 0 || set.wanted > set.poses.rows()) {
    throw InvalidInput(where + " wants " + std::to_string(set.wanted) + " poses; expected 0 to " +
                       std::to_string(set.poses.rows()) + ", its number of poses");
  }
  if (set.together < 1 || set.wanted % set.together != 0 || set.poses.rows() % set.together != 0) {
    throw InvalidInput(where + " wants " + std::to_string(set.wanted) + " of " +
                       std::to_string(set.poses.rows()) + " poses, of which " +
                       std::to_string(set.together) + " are together; expected a multiple of that");
  }
  if (set.readings.size() != 0) {
    check_readings(mechanism, set.poses.rows(), set.readings);
  }
}

// Rows of the set that can be measured: the wanted ones, failed ones replaced by spares.
std::vector<Index> measurable(const PoseSet& set, const ForwardKinematicsResult& taken,
                              const RowMatrix& readings, std::size_t number) {
  std::vector<Index> rows;
  const auto can_be = [&](Index i) {
    return taken.status[static_cast<std::size_t>(i)] == ForwardStatus::converged &&
           readings.row(i).allFinite();
  };
  for (Index i = 0; i < set.poses.rows() && static_cast<Index>(rows.size()) < set.wanted;
       i += set.together) {
    std::vector<Index> group(static_cast<std::size_t>(set.together));
    std::iota(group.begin(), group.end(), i);
    if (std::all_of(group.begin(), group.end(), can_be)) {
      rows.insert(rows.end(), group.begin(), group.end());
    }
  }
  if (static_cast<Index>(rows.size()) < set.wanted) {
    throw InvalidInput("pose set " + std::to_string(number) + ": the mechanism can take only " +
                       std::to_string(rows.size()) + " of its " + std::to_string(set.poses.rows()) +
                       " poses (spares included); " + std::to_string(set.wanted) +
                       " are wanted. Plan with a larger reach margin or more spares");
  }
  return rows;
}

}  // namespace

Mechanism disturb(const Mechanism& nominal, const Tolerances& tolerances, std::uint64_t seed) {
  tolerances.check();
  Random random(seed, kParameters);
  RowMatrix parameters = nominal.parameters();
  for (Index leg = 0; leg < parameters.rows(); ++leg) {
    const Vector deviations = tolerances.deviations(nominal, leg);
    for (Index i = 0; i < parameters.cols(); ++i) {
      parameters(leg, i) += deviations[i] * random.normal();
    }
  }
  return nominal.with_parameters(parameters);
}

Simulation simulate(const Mechanism& actual, const Mechanism& model,
                    const std::vector<PoseSet>& sets, const MeasurementNoise& noise,
                    std::uint64_t seed) {
  noise.check();
  Index total = 0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    check_set(actual, sets[i], i + 1);
    total += sets[i].wanted;
  }
  Simulation result;
  MeasurementSet& measured = result.measurements;
  measured.poses.resize(total, coordinate_count(actual.pose_space()));
  measured.readings.resize(total, actual.leg_count());
  Index next = 0;
  for (std::size_t number = 0; number < sets.size(); ++number) {
    const PoseSet& set = sets[number];
    RowMatrix commanded;
    const ForwardKinematicsResult taken =
        taken_by(actual, told_joints(model, set), set.poses, commanded);
    const RowMatrix readings = sensed(actual, taken, commanded);
    const std::vector<Index> rows = measurable(set, taken, readings, number + 1);
    Index replaced = 0;
    for (const Index row : rows) {
      measured.poses.row(next) = taken.poses.row(row);
      measured.readings.row(next) = readings.row(row);
      measured.leg_sets.push_back(set.leg);
      result.rows.push_back(row);
      replaced += row >= set.wanted ? 1 : 0;
      ++next;
    }
    result.replaced.push_back(replaced);
  }
  Random random(seed, kMeasurements);
  add_noise(actual, noise, random, measured.poses, measured.readings);
  return result;
}

}  // namespace symkin
