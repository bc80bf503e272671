// SPDX-License-Identifier: MIT
#include "symkin/kinematics/forward_kinematics.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr Index kBlock = 256;

// Closures of all legs at some poses: h is poses x legs, by_pose poses x (legs * dof).
struct StackedClosures {
  RowMatrix h, by_pose, by_reading;
};

void stack_closures(const Mechanism& mechanism, ConstRows poses, ConstRows readings,
                    StackedClosures& out) {
  const Index dof = mechanism.dof();
  out.h.resize(poses.rows(), mechanism.leg_count());
  out.by_reading.resize(poses.rows(), mechanism.leg_count());
  out.by_pose.resize(poses.rows(), mechanism.leg_count() * dof);
  ClosureRows rows;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    mechanism.model().linearise_pose(mechanism.leg(leg).parameters, poses,
                                     Vector(readings.col(leg)), rows);
    out.h.col(leg) = rows.closure;
    out.by_reading.col(leg) = rows.by_reading;
    out.by_pose.middleCols(leg * dof, dof) = rows.by_pose;
  }
}

// On which side of its singularities a configuration lies: with as many legs as degrees of freedom
// the sign of det(dh/dpose) (type 2), else a bit per leg (type 1). The working modes of the former
// are compared at the solution, which redundant readings with errors do not allow.
using Aspect = std::uint64_t;

Aspect aspect(const StackedClosures& closures, Index row, Index dof) {
  const Index legs = closures.h.cols();
  if (legs == dof) {
    return pose_determinant(closures.by_pose.row(row).data(), legs, dof) > 0 ? 1 : 0;
  }
  Aspect sides = 0;
  for (Index leg = 0; leg < legs; ++leg) {
    sides = 2 * sides + (closures.by_reading(row, leg) > 0 ? 1 : 0);
  }
  return sides;
}

// The Newton step -J^-1 h, by least squares with more legs than degrees of freedom.
template <int Dof>
Eigen::Matrix<double, Dof, 1> newton_step(const StackedClosures& closures, Index row) {
  using Square = Eigen::Matrix<double, Dof, Dof, Eigen::RowMajor>;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Dof, Eigen::RowMajor>;
  const Index legs = closures.h.cols();
  const Eigen::Map<const Jacobian> jacobian(closures.by_pose.row(row).data(), legs, Dof);
  const Eigen::Map<const Vector> h(closures.h.row(row).data(), legs);
  if (legs == Dof) {
    const Square square = jacobian.template topRows<Dof>();
    const Eigen::Matrix<double, Dof, 1> fixed = h.template head<Dof>();
    if constexpr (Dof <= 3) {
      return -(square.inverse() * fixed);
    } else {
      return -square.partialPivLu().solve(fixed);
    }
  }
  return -Square(jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose() * h);
}

// |h|^2 less |h + J step|^2, which for a Newton step is |J step|^2.
template <int Dof>
double predicted_decrease(const StackedClosures& closures, Index row,
                          const Eigen::Matrix<double, Dof, 1>& step) {
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Dof, Eigen::RowMajor>;
  const Eigen::Map<const Jacobian> jacobian(closures.by_pose.row(row).data(), closures.h.cols(),
                                            Dof);
  return (jacobian * step).squaredNorm();
}

// One pose on its way: the accepted pose, its cost and the step that is being tried from there.
template <int Dof>
struct Iterate {
  Index row = 0;                           // in the caller's arrays
  std::array<double, Dof + 1> accepted{};  // coordinates (a quaternion needs one more)
  double cost = std::numeric_limits<double>::infinity();
  double predicted = 0;  // how much of the cost the whole step would take away, were h linear
  Eigen::Matrix<double, Dof, 1> step = Eigen::Matrix<double, Dof, 1>::Zero();
  double scale = 1;
};

template <int Dof>
class BlockSolver {
 public:
  BlockSolver(const Mechanism& mechanism, ConstRows readings, ConstRows start,
              const ForwardKinematicsOptions& options, ForwardKinematicsResult& result)
      : mechanism_(mechanism),
        readings_(readings),
        start_(start),
        options_(options),
        result_(result) {}

  void solve(Index first, Index count) {
    set_out(first, count);
    for (int i = 0; i < options_.max_iterations && !active_.empty(); ++i) {
      stack_closures(mechanism_, trial_poses_, trial_readings_, closures_);
      advance_all();
    }
  }

 private:
  ConstRows::ConstRowXpr start_row(Index row) const {
    return start_.row(start_.rows() == 1 ? 0 : row);
  }

  void set_out(Index first, Index count) {
    active_.clear();
    trial_poses_.resize(count, start_.cols());
    trial_readings_ = readings_.middleRows(first, count);
    for (Index i = 0; i < count; ++i) {
      trial_poses_.row(i) = start_row(first + i);
      Iterate<Dof> iterate;
      iterate.row = first + i;
      store(i, iterate);
      active_.push_back(iterate);
    }
    note_start_aspects(first, count);
  }

  // At the mechanism's own readings of the start pose; where a leg cannot reach it, at the
  // readings to be solved, which are close to them.
  void note_start_aspects(Index first, Index count) {
    if (start_.rows() == 1 && !start_aspects_.empty()) {
      return;
    }
    const Index distinct = start_.rows() == 1 ? 1 : count;
    RowMatrix own = inverse_kinematics(mechanism_, trial_poses_.topRows(distinct));
    own = own.array().isFinite().select(own, trial_readings_.topRows(distinct));
    stack_closures(mechanism_, trial_poses_.topRows(distinct), own, closures_);
    start_aspects_.clear();
    for (Index i = 0; i < distinct; ++i) {
      start_aspects_.push_back(aspect(closures_, i, Dof));
    }
    first_ = first;
  }

  Aspect start_aspect(Index row) const {
    return start_aspects_[start_.rows() == 1 ? 0 : static_cast<std::size_t>(row - first_)];
  }

  void advance_all() {
    Index kept = 0;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const auto row = static_cast<Index>(i);
      if (advance(active_[i], row)) {
        if (kept != row) {
          active_[static_cast<std::size_t>(kept)] = active_[i];
          trial_readings_.row(kept) = trial_readings_.row(row);
        }
        set_trial(active_[static_cast<std::size_t>(kept)], kept);
        ++kept;
      }
    }
    active_.resize(static_cast<std::size_t>(kept));
    trial_poses_.conservativeResize(kept, Eigen::NoChange);
    trial_readings_.conservativeResize(kept, Eigen::NoChange);
  }

  // Takes or halves the step that was tried; false once the pose is settled.
  bool advance(Iterate<Dof>& iterate, Index trial) {
    const double cost = closures_.h.row(trial).squaredNorm();
    const double tried = iterate.scale * iterate.step.cwiseAbs().maxCoeff();
    // Against the predicted decrease, since the readings of a redundantly actuated mechanism with
    // errors leave a cost that no step takes away.
    const bool decreased = cost <= iterate.cost - 1e-4 * iterate.scale * iterate.predicted;
    // Below sqrt(tolerance) rounding decides whether the cost still falls.
    if (decreased || tried < std::sqrt(options_.step_tolerance) * 1e-2) {
      store(trial, iterate);
      iterate.cost = cost;
      iterate.step = newton_step<Dof>(closures_, trial);
      iterate.predicted = predicted_decrease<Dof>(closures_, trial, iterate.step);
      iterate.scale = 1;
      if (!iterate.step.allFinite()) {
        return false;
      }
      if (iterate.step.cwiseAbs().maxCoeff() < options_.step_tolerance) {
        settle(iterate, trial);
        return false;
      }
      return true;
    }
    iterate.scale /= 2;
    return iterate.scale > 1e-6;
  }

  void store(Index trial, Iterate<Dof>& iterate) const {
    std::copy_n(trial_poses_.row(trial).data(), trial_poses_.cols(), iterate.accepted.data());
  }

  void set_trial(const Iterate<Dof>& iterate, Index trial) {
    const Eigen::Matrix<double, Dof, 1> step = iterate.scale * iterate.step;
    std::copy_n(iterate.accepted.data(), trial_poses_.cols(), trial_poses_.row(trial).data());
    move_pose(mechanism_.pose_space(), step.data(), trial_poses_.row(trial).data());
  }

  void settle(const Iterate<Dof>& iterate, Index trial) {
    double* const pose = result_.poses.row(iterate.row).data();
    std::copy_n(iterate.accepted.data(), result_.poses.cols(), pose);
    move_pose(mechanism_.pose_space(), iterate.step.data(), pose);
    result_.status[static_cast<std::size_t>(iterate.row)] =
        aspect(closures_, trial, Dof) == start_aspect(iterate.row) ? ForwardStatus::converged
                                                                   : ForwardStatus::left_aspect;
  }

  const Mechanism& mechanism_;
  ConstRows readings_;
  ConstRows start_;
  const ForwardKinematicsOptions& options_;
  ForwardKinematicsResult& result_;

  std::vector<Iterate<Dof>> active_;
  RowMatrix trial_poses_, trial_readings_;  // a row each active iterate
  StackedClosures closures_;
  std::vector<Aspect> start_aspects_;
  Index first_ = 0;
};

template <int Dof>
void solve_blocks(const Mechanism& mechanism, ConstRows readings, ConstRows start,
                  const ForwardKinematicsOptions& options, ForwardKinematicsResult& result) {
  BlockSolver<Dof> solver(mechanism, readings, start, options, result);
  for (Index first = 0; first < readings.rows(); first += kBlock) {
    check_interrupt();
    solver.solve(first, std::min(kBlock, readings.rows() - first));
  }
}

// A solution counts only if every leg stands in its working mode there: its reading is the root
// that the mode picks, up to the square root of the rounding at the end of its reach.
void compare_working_modes(const Mechanism& mechanism, ConstRows readings,
                           ForwardKinematicsResult& result) {
  constexpr double kTolerance = 1e-6;  // of the active joint, rad or m
  const RowMatrix roots = inverse_kinematics(mechanism, result.poses);
  const Vector gains = sensor_gains(mechanism);
  Vector differences(readings.rows());
  for (Index leg = 0; leg < readings.cols(); ++leg) {
    mechanism.model().reading_differences(mechanism.leg(leg).parameters, roots.col(leg),
                                          readings.col(leg), differences);
    for (Index i = 0; i < readings.rows(); ++i) {
      ForwardStatus& status = result.status[static_cast<std::size_t>(i)];
      // A root that is not a number, just beyond the reach, fails the comparison too.
      if (status == ForwardStatus::converged &&
          !(std::abs(gains[leg] * differences[i]) < kTolerance)) {
        status = ForwardStatus::left_aspect;
      }
    }
  }
}

}  // namespace

void ForwardKinematicsOptions::check() const {
  if (max_iterations < 1) {
    throw InvalidInput("max_iterations = " + std::to_string(max_iterations) +
                       "; expected at least 1");
  }
  if (!(step_tolerance > 0)) {
    throw InvalidInput("step_tolerance must be positive");
  }
}

Index ForwardKinematicsResult::converged_count() const {
  return std::count(status.begin(), status.end(), ForwardStatus::converged);
}

ForwardKinematicsResult forward_kinematics(const Mechanism& mechanism, ConstRows readings,
                                           ConstRows start,
                                           const ForwardKinematicsOptions& options) {
  options.check();
  check_one_closure(mechanism.model().info(), "forward kinematics");
  check_poses(mechanism, start);
  check_readings(mechanism, readings.rows(), readings);
  if (start.rows() != 1 && start.rows() != readings.rows()) {
    throw InvalidInput("start has " + std::to_string(start.rows()) + " poses; expected 1 or " +
                       std::to_string(readings.rows()) + ", one a row of readings");
  }
  ForwardKinematicsResult result;
  result.poses.setConstant(readings.rows(), start.cols(), std::numeric_limits<double>::quiet_NaN());
  result.status.assign(static_cast<std::size_t>(readings.rows()), ForwardStatus::diverged);
  switch (mechanism.dof()) {
    case 2:
      solve_blocks<2>(mechanism, readings, start, options, result);
      break;
    case 3:
      solve_blocks<3>(mechanism, readings, start, options, result);
      break;
    default:
      solve_blocks<6>(mechanism, readings, start, options, result);
  }
  if (mechanism.leg_count() == mechanism.dof()) {
    compare_working_modes(mechanism, readings, result);
  }
  return result;
}

}  // namespace symkin
