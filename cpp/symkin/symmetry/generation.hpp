// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/group.hpp"

namespace symkin {

// The elements that carry the reference leg to legs 1, 2, ... of a mechanism of `count` legs, in
// the legs' order: r0, r1, ... when the rotations give all legs; r0, s0, r1, s1, ... when it takes
// the whole dihedral group (legs in mirrored pairs). Throws InvalidInput when `count` is neither.
std::vector<SymmetryElement> generating_elements(const SymmetryGroup& group, Index count);

// The images of the reference leg (azimuths and angular offsets within half a turn).
std::vector<Leg> generate_legs(const SymmetryGroup& group, const LegModel& model,
                               const Leg& reference, const std::vector<SymmetryElement>& elements);

}  // namespace symkin
