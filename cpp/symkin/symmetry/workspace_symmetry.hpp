// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/kinematics/workspace.hpp"
#include "symkin/symmetry/verification.hpp"

namespace symkin {

// The workspace theorem (Eq. 2) and the active-joint conjecture (Eq. 5), tested on poses.
struct WorkspaceSymmetry {
  SymmetryElement element;
  Index tested = 0;
  Index inside = 0;       // of them in the workspace
  Index mismatches = 0;   // pose in the workspace and its image not, or the reverse
  Index unreachable = 0;  // poses that a leg cannot reach: the same legs must fail at the image
  // Largest |g(lambda(pose)) - lambda(g(pose))| of the poses inside, sensor units.
  double reading_deviation = 0;
  bool keeps_modes = false;
};

// Draws poses from the workspace's box, inside or not, and carries the same ones by each element.
// An element that flips working modes is tested against the mechanism with the flipped modes, whose
// workspace it maps this one onto. Throws SymmetryMismatch if an element does not map the legs.
std::vector<WorkspaceSymmetry> verify_workspace_symmetry(
    const Mechanism& mechanism, const WorkspaceOptions& options, const SymmetryGroup& group,
    const std::vector<SymmetryElement>& elements, Index count, std::uint64_t seed,
    const SymmetryTolerance& tolerance = {});

}  // namespace symkin
