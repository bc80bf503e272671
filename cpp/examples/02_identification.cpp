// SPDX-License-Identifier: MIT
// From candidate poses to a calibrated five-bar, stage by stage.
#include <cmath>
#include <iostream>

#include "symkin/chains/registry.hpp"
#include "symkin/design/design.hpp"
#include "symkin/estimation/evaluation.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/workspace.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/generation.hpp"

int main() {
  constexpr double kPi = 3.141592653589793;
  const symkin::ChainModel& model = symkin::leg_model("[R]RR", symkin::Platform::point);
  symkin::Vector leg(model.parameter_count());
  leg << 0.3, 0.4, 0.15, 0.0, 1.0, 0.2;  // l, L, base radius and angle, gain, offset

  // Leg 2 is the mirror image of leg 1 about the Y axis.
  const auto group = symkin::SymmetryGroup::named("D1", kPi / 2);
  const auto elements = symkin::generating_elements(group, 2);
  const symkin::Mechanism nominal("five-bar", model,
                                  symkin::generate_legs(group, model, {leg, -1}, elements));

  symkin::WorkspaceOptions workspace;
  workspace.lower = Eigen::Vector2d(-0.3, 0.2);
  workspace.upper = Eigen::Vector2d(0.3, 0.6);
  workspace.home = Eigen::Vector2d(0, 0.4);
  workspace.reach_margin = 0.02;
  const auto candidates = symkin::sample_workspace(nominal, workspace, 2000, 1);

  // Optimal poses for leg 1, carried to leg 2.
  const symkin::MeasurementNoise noise{2e-5, 0, 1e-5};
  const symkin::RowMatrix rows =
      symkin::observability_rows(nominal, 0, candidates.poses, symkin::RowKind::noise_aware, noise);
  symkin::design::SelectionOptions selection;
  selection.count = 18;
  selection.spare_count = 4;
  const auto chosen =
      symkin::design::select_poses(symkin::design::CandidateRows{rows, 1}, selection);
  symkin::RowMatrix reference(22, 2);
  for (symkin::Index i = 0; i < 22; ++i) {
    const auto at = static_cast<std::size_t>(i);
    reference.row(i) = candidates.poses.row(i < 18 ? chosen.indices[at] : chosen.spares[at - 18]);
  }
  std::vector<symkin::PoseSet> plan;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    plan.push_back(
        {static_cast<symkin::Index>(i),
         symkin::transform_poses(group, elements[i], symkin::PoseSpace::point, reference), 18});
  }

  // A robot as the workshop made it, measured and identified.
  const symkin::Mechanism actual = symkin::disturb(nominal, {2e-4, 1e-3, 1e-3}, 7);
  const auto measured = symkin::simulate(actual, nominal, plan, noise, 7).measurements;
  symkin::IdentificationOptions options;
  options.noise = noise;
  const auto found = symkin::identify(nominal, measured, options);
  const auto calibrated = nominal.with_parameters(found.parameters);

  const auto before = symkin::command_errors(actual, nominal, candidates.poses);
  const auto after = symkin::command_errors(actual, calibrated, candidates.poses);
  std::cout << "position error " << before.position_rms << " m before, " << after.position_rms
            << " m after\n";
  return found.converged && after.position_rms < 0.1 * before.position_rms ? 0 : 1;
}
