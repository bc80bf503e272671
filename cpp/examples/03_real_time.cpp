// SPDX-License-Identifier: MIT
// The pose of a 3-RRR from its readings in a control loop of 1 kHz, without touching the heap.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>
#include <vector>

#include "count_allocations.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/symmetry/generation.hpp"

using Clock = std::chrono::steady_clock;
constexpr double kPi = 3.141592653589793;
constexpr symkin::Index kCycles = 1000;
constexpr std::chrono::milliseconds kPeriod{1};

symkin::Mechanism calibrated_robot() {
  const symkin::ChainModel& model = symkin::leg_model("[R]RR");
  symkin::Vector leg(model.parameter_count());
  leg << 1.5, 1.5, 6 / std::sqrt(3.0), 7 * kPi / 6, 1.5 / std::sqrt(3.0), 7 * kPi / 6, 1, kPi / 6;
  const auto group = symkin::SymmetryGroup::named("C3");
  const auto elements = symkin::generating_elements(group, 3);
  return {"3-RRR", model, symkin::generate_legs(group, model, {leg, -1}, elements)};
}

// Two circles of 0.3 m, the platform swinging by 0.2 rad.
symkin::RowMatrix path() {
  symkin::RowMatrix poses(kCycles, 3);
  for (symkin::Index i = 0; i < kCycles; ++i) {
    const double turn = 4 * kPi * static_cast<double>(i) / static_cast<double>(kCycles);
    poses.row(i) << 0.3 * std::cos(turn), 0.3 * std::sin(turn), 0.2 * std::sin(turn);
  }
  return poses;
}

int main() {
  const symkin::Mechanism robot = calibrated_robot();
  const symkin::RowMatrix driven = path();
  const symkin::RowMatrix encoders = symkin::inverse_kinematics(robot, driven);

  // All memory is taken before the loop.
  const symkin::ForwardKinematicsOptions options;
  symkin::RowMatrix readings = encoders.topRows(1);
  symkin::RowMatrix pose = driven.topRows(1);
  symkin::ForwardKinematicsResult result;
  symkin::forward_kinematics(robot, readings, pose, options, result);
  std::vector<double> microseconds(kCycles);
  double largest_error = 0;

  const long before = allocations;
  Clock::time_point wake = Clock::now();
  for (symkin::Index i = 0; i < kCycles; ++i) {
    wake += kPeriod;
    std::this_thread::sleep_until(wake);
    const Clock::time_point start = Clock::now();
    readings = encoders.row(i);  // here a controller reads its encoders
    symkin::forward_kinematics(robot, readings, pose, options, result);
    if (result.status[0] != symkin::ForwardStatus::converged) {
      break;  // here it stops its motors
    }
    pose = result.poses;  // where the next cycle starts
    microseconds[static_cast<std::size_t>(i)] =
        std::chrono::duration<double, std::micro>(Clock::now() - start).count();
    largest_error = std::max(largest_error, (pose - driven.row(i)).cwiseAbs().maxCoeff());
  }
  const long allocated = allocations - before;

  std::sort(microseconds.begin(), microseconds.end());
  std::cout << kCycles << " cycles: usually " << microseconds[kCycles / 2] << " us, at worst "
            << microseconds.back() << " us; " << allocated << " allocations; largest error "
            << largest_error << " m or rad\n";
  const bool all_solved = result.status[0] == symkin::ForwardStatus::converged;
  return all_solved && allocated == 0 && before > 0 && largest_error < 1e-12 ? 0 : 1;
}
