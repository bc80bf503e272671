// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/group.hpp"
#include "symkin/symmetry/verification.hpp"

namespace symkin {

// The symmetry of a mechanism, found from its legs alone.
struct DetectedSymmetry {
  SymmetryGroup structure;   // G_M: largest group that maps the legs onto themselves, working
                             // modes and sensors aside
  SymmetryGroup with_modes;  // its subgroup that keeps the working modes too
  std::vector<ElementImage> images;  // what each element of `structure` does to the legs
};

// Finds the largest group C_n or D_n, about any centre and with any axis, within the tolerance:
// the centre of base and platform from all legs, rotations by their order, reflections by the
// axes on which pairs of legs mirror each other. A mechanism without symmetry has C_1. Symmetries
// are about Z; those about tilted axes are not looked for.
DetectedSymmetry detect_symmetry(const Mechanism& mechanism,
                                 const SymmetryTolerance& tolerance = {});

// How every leg differs from a perfectly symmetric mechanism, legs x p: each leg is carried back
// to the reference leg of its orbit and compared with the median of the orbit's legs; signs are
// those of the leg where it stands. Elements that map the legs within `tolerance` are used; a leg
// alone in its orbit has zeros.
RowMatrix symmetry_deviations(const Mechanism& mechanism, const SymmetryGroup& group,
                              const SymmetryTolerance& tolerance);

}  // namespace symkin
