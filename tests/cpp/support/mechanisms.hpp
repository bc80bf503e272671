// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "symkin/chains/registry.hpp"
#include "symkin/kinematics/workspace.hpp"
#include "symkin/symmetry/generation.hpp"

// The mechanisms that the suites share.
namespace symkin::testing {

// The 3-RRR of Durango et al. (2010), section 6.
inline Mechanism paper_3rrr(int working_mode = -1) {
  Vector parameters(8);
  const double corner = 7 * kPi / 6;
  parameters << 1.5, 1.5, 6 / std::sqrt(3.0), corner, 1.5 / std::sqrt(3.0), corner, 1, kPi / 6;
  const SymmetryGroup group = SymmetryGroup::named("C3");
  const ChainModel& model = leg_model("[R]RR");
  return {"3-RRR", model,
          generate_legs(group, model, {parameters, working_mode}, generating_elements(group, 3))};
}

inline WorkspaceOptions paper_workspace() {
  WorkspaceOptions options;
  options.lower = Eigen::Vector3d(-0.55, -0.4, -0.4);
  options.upper = Eigen::Vector3d(0.55, 0.65, 0.85);
  options.home = Vector::Zero(3);
  options.reach_margin = 0.05;
  return options;
}

// A hexapod with legs in mirrored pairs: D3 about the vertical plane at 210 degrees.
inline Mechanism hexapod() {
  Vector parameters(8);
  parameters << 0.41, kPi / 2, 200 * kPi / 180, 0.22, kPi / 2, 154 * kPi / 180, 0.0115, 0.6;
  const SymmetryGroup group = SymmetryGroup::named("D3", 210 * kPi / 180);
  const ChainModel& model = leg_model("U[P]S");
  return {"hexapod", model,
          generate_legs(group, model, {parameters, -1}, generating_elements(group, 6))};
}

inline WorkspaceOptions hexapod_workspace() {
  WorkspaceOptions options;
  options.lower = Vector(6);
  options.lower << -0.2, -0.2, 0.6, -0.25, -0.25, -0.2;
  options.upper = Vector(6);
  options.upper << 0.2, 0.2, 0.8, 0.25, 0.25, 0.2;
  options.home = identity_pose(PoseSpace::spatial);
  options.home[2] = 0.7;
  options.conditioning_limit = 100;
  options.characteristic_length = 0.22;
  return options;
}

// Three legs that bind their platform: struts, or sliders on vertical guides.
inline Mechanism three_rps() {
  Vector parameters(11);
  parameters << 0.5, 0, 0, 0, 0, 0, 0.5, 0, 0, 1, 0;
  const SymmetryGroup group = SymmetryGroup::named("D3");
  const ChainModel& model = leg_model("R[P]S");
  return {"3-RPS", model,
          generate_legs(group, model, {parameters, 1}, generating_elements(group, 3))};
}

inline Mechanism three_prs() {
  Vector parameters(15);
  parameters << 0.6, 0.4, 0, 0, 0, kPi / 2, 0, 0, 0, 0, 0.25, 0, 0, 1, 0;
  const SymmetryGroup group = SymmetryGroup::named("D3");
  const ChainModel& model = leg_model("[P]RS");
  return {"3-PRS", model,
          generate_legs(group, model, {parameters, 1}, generating_elements(group, 3))};
}

// A five-bar: two [R]RR legs that carry a point, mirrored about the Y axis.
inline Mechanism five_bar() {
  Vector parameters(6);
  parameters << 0.3, 0.4, 0.15, 0.0, 1, 0.2;
  const SymmetryGroup group = SymmetryGroup::named("D1", kPi / 2);
  const ChainModel& model = leg_model("[R]RR", Platform::point);
  return {"five-bar", model,
          generate_legs(group, model, {parameters, -1}, generating_elements(group, 2))};
}

}  // namespace symkin::testing
