// SPDX-License-Identifier: MIT
// A mechanism from one leg and its symmetry, and its kinematics both ways.
#include <cmath>
#include <iostream>

#include "symkin/chains/registry.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/symmetry/generation.hpp"

int main() {
  constexpr double kPi = 3.141592653589793;
  // The 3-RRR of Durango et al. (2010); the names are model.info().parameters.
  const symkin::ChainModel& model = symkin::leg_model("[R]RR");
  symkin::Vector leg(model.parameter_count());
  leg << 1.5, 1.5, 6 / std::sqrt(3.0), 7 * kPi / 6, 1.5 / std::sqrt(3.0), 7 * kPi / 6, 1, kPi / 6;

  const auto group = symkin::SymmetryGroup::named("C3");
  const symkin::Mechanism mechanism(
      "3-RRR", model,
      symkin::generate_legs(group, model, {leg, -1}, symkin::generating_elements(group, 3)));

  symkin::RowMatrix pose(1, 3);
  pose << 0.3, -0.2, 0.1;  // x, y in metres, phi in radians
  const symkin::RowMatrix readings = symkin::inverse_kinematics(mechanism, pose);
  const symkin::RowMatrix home = symkin::RowMatrix::Zero(1, 3);
  const auto found = symkin::forward_kinematics(mechanism, readings, home);

  std::cout << "readings " << readings << "\npose     " << found.poses << '\n';
  const bool returned = found.converged_count() == 1 && (found.poses - pose).norm() < 1e-12;
  return returned ? 0 : 1;
}
