// SPDX-License-Identifier: MIT
#include "symkin/estimation/fleet.hpp"

#include <algorithm>
#include <limits>

#include "symkin/estimation/detail/identifier.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/parallel.hpp"

namespace symkin {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Index kRobots = 64;  // of a task

void take(const MeasuredRobot& robot, const Mechanism& mechanism, MeasurementSet& measurements) {
  using View = Eigen::Map<const RowMatrix>;
  measurements.poses = View(robot.poses, robot.count, coordinate_count(mechanism.pose_space()));
  measurements.readings = View(robot.readings, robot.count, mechanism.leg_count());
  measurements.leg_sets.assign(robot.leg_sets, robot.leg_sets + robot.count);
}

std::string failure_of(const Identification& found) {
  std::string failure;
  for (std::size_t leg = 0; leg < found.legs.size(); ++leg) {
    if (!found.legs[leg].converged) {
      failure += (failure.empty() ? "leg " : ", leg ") + std::to_string(leg + 1) + " (" +
                 found.legs[leg].failure + ")";
    }
  }
  return failure;
}

void set_row(Fleet& fleet, Index robot, const Identification& found, const Vector& variances) {
  const RowMatrix& parameters = found.parameters;
  fleet.parameters.row(robot) =
      Eigen::Map<const Vector>(parameters.data(), parameters.size()).transpose();
  fleet.deviations.row(robot) = variances.cwiseSqrt().transpose();
  for (std::size_t k = 0; k < found.goodness.size(); ++k) {
    const GoodnessOfFit& fit = found.goodness[k];
    const auto column = static_cast<Index>(k);
    fleet.chi_square(robot, column) = fit.chi_square;
    fleet.degrees_of_freedom(robot, column) = fit.degrees_of_freedom;
    fleet.limit(robot, column) = fit.limit;
    fleet.least(robot, column) = fit.least;
  }
  fleet.residual_rms[robot] = found.residual_rms;
  fleet.rejected[robot] = 0;
  for (std::size_t k = 0; k < found.legs.size(); ++k) {
    const LegIdentification& leg = found.legs[k];
    fleet.rejected[robot] += static_cast<double>(leg.rejected.size());
    fleet.student_degrees(robot, static_cast<Index>(k)) = leg.student_degrees;
  }
  fleet.failures[static_cast<std::size_t>(robot)] = failure_of(found);
}

}  // namespace

Fleet identify_many(const Mechanism& mechanism, const MeasurementSet& measurements,
                    const std::vector<Index>& first, const IdentificationOptions& options,
                    int threads) {
  const Index rows = measurements.poses.rows();
  check_poses(mechanism, measurements.poses);
  check_readings(mechanism, rows, measurements.readings);
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (first[i] < (i == 0 ? 0 : first[i - 1]) || first[i] > rows) {
      throw InvalidInput("the rows of robot " + std::to_string(i) + " begin at row " +
                         std::to_string(first[i]) + " of " + std::to_string(rows) +
                         "; expected ascending rows");
    }
  }
  std::vector<MeasuredRobot> robots;
  for (std::size_t i = 0; i + 1 < first.size(); ++i) {
    const Index row = first[i];
    robots.push_back({first[i + 1] - row,
                      measurements.poses.data() + row * measurements.poses.cols(),
                      measurements.readings.data() + row * measurements.readings.cols(),
                      measurements.leg_sets.data() + row});
  }
  return identify_many(mechanism, robots, options, threads);
}

Fleet identify_many(const Mechanism& mechanism, const std::vector<MeasuredRobot>& measured,
                    const IdentificationOptions& options, int threads) {
  options.check();
  const auto robots = static_cast<Index>(measured.size());
  const Index legs = mechanism.leg_count();
  const Index size = legs * mechanism.parameter_count();
  const Index fits = options.estimator == Estimator::joint ? 1 : legs;
  Fleet fleet;
  fleet.parameters = fleet.deviations = RowMatrix::Constant(robots, size, kNan);
  fleet.chi_square = fleet.degrees_of_freedom = fleet.limit = fleet.least =
      RowMatrix::Constant(robots, fits, kNan);
  fleet.student_degrees = RowMatrix::Constant(robots, legs, kNan);
  fleet.residual_rms = fleet.rejected = Vector::Constant(robots, kNan);
  fleet.failures.resize(static_cast<std::size_t>(robots));
  IdentificationOptions lean = options;
  lean.conditions = false;
  parallel_for((robots + kRobots - 1) / kRobots, threads, [&](Index task) {
    Identifier identifier(mechanism, lean, LegSolver::steps);
    MeasurementSet own;
    for (Index i = task * kRobots; i < std::min(robots, (task + 1) * kRobots); ++i) {
      const auto robot = static_cast<std::size_t>(i);
      try {
        take(measured[robot], mechanism, own);
        const Identification& found = identifier.identify(own);
        set_row(fleet, i, found, identifier.variances());
      } catch (const Error& error) {
        fleet.failures[robot] = error.what();
      }
    }
  });
  return fleet;
}

}  // namespace symkin
