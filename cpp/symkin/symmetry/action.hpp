// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/group.hpp"
#include "symkin/symmetry/pair.hpp"

namespace symkin {

// How a group element acts on what describes a mechanism (theory: the table of actions in
// docs/theory.md). All of them together leave every closure h unchanged. They throw InvalidInput
// for poses or parameters of another number than the pose space or the chain has.

// The motions of base and platform that an element stands for.
SymmetryPair pair_of(const SymmetryGroup& group, SymmetryElement element);

// Poses, one a row (Eqs. 14, 22; planar rotations leave the orientation as it is).
RowMatrix transform_poses(const SymmetryGroup& group, SymmetryElement element, PoseSpace space,
                          ConstRows poses);

// The image of a leg: its parameters and its working mode.
Leg transform_leg(const SymmetryGroup& group, SymmetryElement element, const ChainInfo& chain,
                  const Leg& leg);

// +1, or -1 where the image leg's sensor counts the other way.
double reading_sign(SymmetryElement element, ActiveJoint joint);

}  // namespace symkin
