// SPDX-License-Identifier: MIT
// A problem that symkin does not have: two calibrated 3-RRR hold one part, and from their encoders
// alone follow where the second robot stands and how it holds the part. Legs of symkin in a
// ceres::Problem.
#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <vector>

#include "symkin/chains/registry.hpp"
#include "symkin/chains/rrr.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_constraint.hpp"
#include "symkin/symmetry/generation.hpp"

using Constraint = symkin::LegConstraint<symkin::RrrActive1>;

// The planar pose (x, y, phi) of `inner` seen from where `outer` is seen.
template <typename T>
std::array<T, 3> chained(const T* outer, const T* inner) {
  using std::cos;
  using std::sin;
  const T c = cos(outer[2]);
  const T s = sin(outer[2]);
  return {outer[0] + c * inner[0] - s * inner[1], outer[1] + s * inner[0] + c * inner[1],
          outer[2] + inner[2]};
}

// Residual: the closure of a leg of the second robot (m), whose platform stands at `base` seen from
// the first robot's, times the pose of the part, times `grasp`.
struct SecondRobot {
  symkin::Vector parameters;
  double reading;

  template <typename T>
  bool operator()(const T* base, const T* pose, const T* grasp, T* closure) const {
    const std::vector<T> known(parameters.begin(), parameters.end());
    const auto held = chained(pose, grasp);
    const T measured(reading);
    return Constraint()(known.data(), chained(base, held.data()).data(), &measured, closure);
  }
};

int main() {
  constexpr double kPi = 3.141592653589793;
  const auto& model = symkin::leg_model("[R]RR");
  symkin::Vector leg(model.parameter_count());
  leg << 1.5, 1.5, 6 / std::sqrt(3.0), 7 * kPi / 6, 1.5 / std::sqrt(3.0), 7 * kPi / 6, 1, kPi / 6;
  const auto group = symkin::SymmetryGroup::named("C3");
  const symkin::Mechanism robot(
      "3-RRR", model,
      symkin::generate_legs(group, model, {leg, -1}, symkin::generating_elements(group, 3)));

  // What both encoders show while the part moves.
  const double true_base[] = {0.11, -0.08, 0.1}, true_grasp[] = {-0.05, 0.04, -0.2};
  symkin::RowMatrix first(12, 3), second(12, 3);
  for (symkin::Index i = 0; i < first.rows(); ++i) {
    const double turn = 2 * kPi * static_cast<double>(i) / 12;
    first.row(i) << 0.3 * std::cos(turn), 0.3 * std::sin(2 * turn), 0.2 * std::sin(turn);
    const auto held = chained(first.row(i).data(), true_grasp);
    const auto pose = chained(true_base, held.data());
    second.row(i) << pose[0], pose[1], pose[2];
  }
  const symkin::RowMatrix readings = symkin::inverse_kinematics(robot, first);
  const symkin::RowMatrix others = symkin::inverse_kinematics(robot, second);

  // Poses start at home, base and grasp as if both robots stood on each other.
  double base[3] = {}, grasp[3] = {};
  symkin::RowMatrix poses = symkin::RowMatrix::Zero(first.rows(), 3);
  std::vector<symkin::Vector> parameters;
  for (const symkin::Leg& each : robot.legs()) {
    parameters.push_back(each.parameters);
  }
  symkin::RowMatrix measured = readings;
  ceres::Problem problem;
  for (symkin::Index i = 0; i < poses.rows(); ++i) {
    for (symkin::Index l = 0; l < 3; ++l) {
      double* known = parameters[static_cast<std::size_t>(l)].data();
      problem.AddResidualBlock(Constraint::create(), nullptr, known, poses.row(i).data(),
                               &measured(i, l));
      problem.SetParameterBlockConstant(known);
      problem.SetParameterBlockConstant(&measured(i, l));
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<SecondRobot, 1, 3, 3, 3>(
              new SecondRobot{parameters[static_cast<std::size_t>(l)], others(i, l)}),
          nullptr, base, poses.row(i).data(), grasp);
    }
  }
  ceres::Solver::Options options;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-15;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  double off = 0;
  for (int i = 0; i < 3; ++i) {
    off = std::max({off, std::abs(base[i] - true_base[i]), std::abs(grasp[i] - true_grasp[i])});
  }
  std::cout << "base  " << base[0] << ' ' << base[1] << ' ' << base[2] << "\ngrasp " << grasp[0]
            << ' ' << grasp[1] << ' ' << grasp[2] << '\n';
  return off < 1e-9 ? 0 : 1;
}
