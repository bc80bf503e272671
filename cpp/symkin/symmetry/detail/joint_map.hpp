// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "symkin/symmetry/pairs.hpp"

namespace symkin {

// What carrying leg `from` onto leg `onto` of the same chain does to its joint. Empty if the links
// differ, in lengths or arcs, by more than kImageTolerances.
std::optional<JointMap> joint_map(const ChainInfo& chain, const Leg& from, const Leg& onto,
                                  const SymmetryPair& pair, const SymmetryTolerance& tolerance);

// Whether leg `from`, carried onto leg `onto`, arrives in its working mode; of a chain with one
// root always.
bool arrives_in_mode(const ChainInfo& chain, const Leg& from, const Leg& onto, const JointMap& map);

// By how much the links differ, in tolerances; of arcs, on a sphere, joint_map tells. Of a leg that
// arrives with its ends exchanged the links change places; infinite for a chain that cannot.
double links_apart(const ChainInfo& chain, const Leg& from, const Leg& onto, bool improper,
                   bool exchange, const SymmetryTolerance& tolerance);

}  // namespace symkin
