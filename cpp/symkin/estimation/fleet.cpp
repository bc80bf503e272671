// SPDX-License-Identifier: MIT
#include "symkin/estimation/fleet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/estimation/detail/identifier.hpp"
#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
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

// Robots of one drawing, as many at once as there are lanes.
class Robots {
 public:
  Robots(const Mechanism& mechanism, const IdentificationOptions& options, Fleet& fleet)
      : mechanism_(mechanism),
        joint_(options.estimator == Estimator::joint),
        identifier_(mechanism, options),
        fleet_(fleet) {
    for (Index leg = 0; leg < mechanism.leg_count() && LegFits::can(options); ++leg) {
      legs_.emplace_back(mechanism, leg, options);
    }
  }

  // Robots from row `first` of the fleet on.
  void identify(const MeasuredRobot* measured, Index count, Index first) {
    for (LegFits& leg : legs_) {
      leg.fit(measured, count);
    }
    has_jackknife_ = false;
    for (Index i = 0; i < count; ++i) {
      if (!joint_ && is_clear(measured[i], i)) {
        set_row(first + i, i);
        continue;
      }
      try {
        take(measured[i], mechanism_, own_);
        set_row(first + i, identifier_.identify(own_, joint_ ? parameters_of(legs_, i) : none_));
      } catch (const Error& error) {
        fleet_.failures[static_cast<std::size_t>(first + i)] = error.what();
      }
    }
  }

 private:
  bool is_clear(const MeasuredRobot& robot, Index i) const {
    const double* const end = robot.poses + robot.count * coordinate_count(mechanism_.pose_space());
    return !legs_.empty() && std::all_of(legs_.begin(), legs_.end(), [&](const LegFits& leg) {
      return leg.of(i).clear;
    }) && std::all_of(robot.poses, end, [](double value) { return std::isfinite(value); });
  }

  void set_goodness(Index robot, Index column, const GoodnessOfFit& fit) {
    fleet_.chi_square(robot, column) = fit.chi_square;
    fleet_.degrees_of_freedom(robot, column) = fit.degrees_of_freedom;
    fleet_.limit(robot, column) = fit.limit;
    fleet_.least(robot, column) = fit.least;
  }

  void set_row(Index robot, const Identification& found) {
    const RowMatrix& parameters = found.parameters;
    fleet_.parameters.row(robot) =
        Eigen::Map<const Vector>(parameters.data(), parameters.size()).transpose();
    fleet_.deviations.row(robot) = identifier_.covariance().diagonal().cwiseSqrt().transpose();
    for (std::size_t k = 0; k < found.goodness.size(); ++k) {
      set_goodness(robot, static_cast<Index>(k), found.goodness[k]);
    }
    fleet_.residual_rms[robot] = found.residual_rms;
    fleet_.rejected[robot] = 0;
    for (std::size_t k = 0; k < found.legs.size(); ++k) {
      const LegIdentification& leg = found.legs[k];
      fleet_.rejected[robot] += static_cast<double>(leg.rejected.size());
      fleet_.student_degrees(robot, static_cast<Index>(k)) = leg.student_degrees;
    }
    fleet_.failures[static_cast<std::size_t>(robot)] = failure_of(found);
  }

  // Of a robot whose legs are all clear.
  void set_row(Index robot, Index i) {
    const Index p = mechanism_.parameter_count();
    const bool by_residuals = std::any_of(legs_.begin(), legs_.end(), [&](const LegFits& leg) {
      return leg.of(i).wants_jackknife();
    });
    if (by_residuals && !has_jackknife_) {
      for (LegFits& leg : legs_) {
        leg.find_jackknife();
      }
      has_jackknife_ = true;
    }
    double squares = 0, closures = 0, rejected = 0;
    for (Index leg = 0; leg < mechanism_.leg_count(); ++leg) {
      const LegFit& fit = legs_[static_cast<std::size_t>(leg)].of(i);
      fleet_.parameters.row(robot).segment(leg * p, p) = fit.parameters.transpose();
      fleet_.deviations.row(robot).segment(leg * p, p) =
          (by_residuals ? fit.jackknife : fit.variances).cwiseSqrt().transpose();
      set_goodness(robot, leg, fit.goodness);
      fleet_.student_degrees(robot, leg) = fit.student_degrees;
      squares += fit.closure_squares;
      closures += static_cast<double>(fit.closures);
      rejected += static_cast<double>(fit.rejected);
    }
    fleet_.residual_rms[robot] = std::sqrt(squares / closures);
    fleet_.rejected[robot] = rejected;
  }

  const Mechanism& mechanism_;
  bool joint_;
  Identifier identifier_;  // of robots that want a closer look
  Fleet& fleet_;
  std::vector<LegFits> legs_;  // empty: every robot does
  bool has_jackknife_ = false;
  MeasurementSet own_;
  RowMatrix none_;
};

}  // namespace

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
    Robots some(mechanism, lean, fleet);
    const Index end = std::min(robots, (task + 1) * kRobots);
    for (Index first = task * kRobots; first < end; first += LegFits::lanes()) {
      check_interrupt();
      some.identify(measured.data() + first, std::min(end - first, LegFits::lanes()), first);
    }
  });
  return fleet;
}

}  // namespace symkin
