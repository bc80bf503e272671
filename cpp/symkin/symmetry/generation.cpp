// SPDX-License-Identifier: MIT
#include "symkin/symmetry/generation.hpp"

#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {

std::vector<SymmetryElement> generating_elements(const SymmetryGroup& group, Index count) {
  std::vector<SymmetryElement> elements;
  const bool pairs = group.dihedral() && count == group.size();
  if (count != group.rotations() && !pairs) {
    throw InvalidInput(
        "the group " + group.name() + " carries one leg to " + std::to_string(group.rotations()) +
        " legs" +
        (group.dihedral() ? " (a leg on a mirror line) or " + std::to_string(group.size()) : "") +
        "; got " + std::to_string(count));
  }
  for (int m = 0; m < group.rotations(); ++m) {
    elements.push_back({m, false});
    if (pairs) {
      elements.push_back({m, true});
    }
  }
  return elements;
}

std::vector<Leg> generate_legs(const SymmetryGroup& group, const LegModel& model,
                               const Leg& reference, const std::vector<SymmetryElement>& elements) {
  std::vector<Leg> legs;
  const ChainInfo& chain = model.info();
  for (const SymmetryElement element : elements) {
    Leg leg = transform_leg(group, element, chain, reference);
    for (Index i = 0; i < leg.parameters.size(); ++i) {
      const bool angular = chain.is_angular(chain.parameters[static_cast<std::size_t>(i)]);
      // The reference leg stays as it was written.
      if (angular && !(element == SymmetryElement{})) {
        leg.parameters[i] = wrap_angle(leg.parameters[i]);
      }
    }
    legs.push_back(std::move(leg));
  }
  return legs;
}

}  // namespace symkin
