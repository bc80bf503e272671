// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "support/mechanisms.hpp"
#include "symkin/model/leg_layout.hpp"

// Mechanisms whose legs are of different chains, with the workspaces that they are tested in.
namespace symkin::testing {

struct Mixed {
  Mechanism mechanism;
  WorkspaceOptions workspace;
};

struct LegOfChain {
  const ChainModel* chain;
  Leg leg;  // by the chain's own parameters
};

inline Mechanism mixed_mechanism(const std::string& name, const std::vector<LegOfChain>& given) {
  std::vector<const ChainModel*> chains;
  for (const LegOfChain& each : given) {
    chains.push_back(each.chain);
  }
  const LegModels models = in_one_layout(chains);
  std::vector<Leg> legs;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto& [chain, leg] = given[i];
    legs.push_back({in_layout(models[i]->info(), chain->info(), leg.parameters), leg.working_mode});
  }
  return {name, chains, legs};
}

// Two cranks that the Y axis exchanges, and a slider on a guide across it, with the point that it
// carries on the axis.
inline Mixed cranks_and_slider() {
  const Mechanism cranks = paper_3rrr(1);
  Vector slider(7);
  slider << 2.0, 1.9, kPi / 2, 1.5 / std::sqrt(3.0), kPi / 2, 1, 0.3;
  const ChainModel& crank = *cranks.chain();
  WorkspaceOptions workspace = paper_workspace();
  workspace.lower = Eigen::Vector3d(-0.4, -0.3, -0.3);
  workspace.upper = Eigen::Vector3d(0.4, 0.4, 0.3);
  return {mixed_mechanism("2-RRR-PRR", {{&crank, cranks.leg(0)},
                                        {&crank, cranks.leg(1)},
                                        {&leg_model("[P]RR"), {slider, -1}}}),
          workspace};
}

// Three struts and three rods on inclined guides, which a third of a turn carries onto each other.
inline Mixed struts_and_sliders() {
  const Mechanism struts = hexapod();
  const SymmetryGroup group = SymmetryGroup::named("C3");
  const ChainModel& slider = leg_model("[P]US");
  Vector parameters(12);
  parameters << 0.6, 0.41, 220 * kPi / 180, 0, 220 * kPi / 180, kPi / 2, 0.7, 0.22, 266 * kPi / 180,
      0, 1, 0.1;
  const auto sliders =
      generate_legs(group, slider, {parameters, -1}, generating_elements(group, 3));
  std::vector<LegOfChain> legs;
  for (Index i = 0; i < 3; ++i) {
    legs.push_back({struts.chain(), struts.leg(2 * i)});
    legs.push_back({&slider, sliders[static_cast<std::size_t>(i)]});
  }
  WorkspaceOptions workspace = hexapod_workspace();
  workspace.lower << -0.1, -0.1, 0.65, -0.15, -0.15, -0.15;
  workspace.upper << 0.1, 0.1, 0.75, 0.15, 0.15, 0.15;
  workspace.conditioning_limit = 20;
  return {mixed_mechanism("3-UPS-3-PUS", legs), workspace};
}

// A platform that does not turn on two sliders and a strut.
inline Mixed translating_platform() {
  const ChainModel& slider = leg_model("[P]US", Platform::translating);
  const ChainModel& strut = leg_model("U[P]S", Platform::translating);
  Vector first(9);
  first << 0.6, 0.4, 0, 0.1, 0, kPi / 2, 0, 1, 0;
  Vector second = first;
  second[2] = second[4] = 2 * kPi / 3;
  Vector last(5);
  last << 0.4, kPi / 2, 4 * kPi / 3, 1, -0.2;
  WorkspaceOptions workspace;
  workspace.lower = Eigen::Vector3d(-0.1, -0.1, 0.3);
  workspace.upper = Eigen::Vector3d(0.1, 0.1, 0.5);
  workspace.home = Eigen::Vector3d(0, 0, 0.4);
  return {mixed_mechanism("2-PUS-UPS",
                          {{&slider, {first, -1}}, {&slider, {second, -1}}, {&strut, {last, 1}}}),
          workspace};
}

inline std::vector<Mixed> all_mixed() {
  return {cranks_and_slider(), struts_and_sliders(), translating_platform()};
}

}  // namespace symkin::testing
