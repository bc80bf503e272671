// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/group.hpp"

namespace symkin {

// By how much every parameter may differ from that of a symmetric mechanism.
struct SymmetryTolerance {
  double length = 1e-6;  // m
  double angle = 1e-6;   // rad
  double gain = 1e-6;

  void check() const;  // throws InvalidInput
};

// The image of a leg differs from a leg by the errors of both and by what all legs' errors do to
// the centre and the axis that are found from them: by up to so many tolerances.
constexpr double kImageTolerances = 4;

// How one leg's image differs from a leg of the mechanism, in units of the tolerance. Joints are
// compared by where they are, not by their polar coordinates: an angle means nothing at radius
// zero, and (r, a) is (-r, a + pi).
struct LegDeviation {
  Index leg = 0;             // whose image is compared
  Index nearest = 0;         // the leg that the image is nearest to
  std::string parameter;     // that deviates most; empty if nothing does
  double deviation = 0;      // of that parameter: m, rad or gain
  double in_tolerances = 0;  // <= kImageTolerances means the leg maps
  bool same_mode = true;     // the image has the nearest leg's working mode
};

// What an element does to the legs.
struct ElementImage {
  SymmetryElement element;
  std::vector<Index> permutation;        // leg -> leg that its image is nearest to
  std::vector<LegDeviation> deviations;  // one a leg
  bool keeps_structure = false;          // maps the set of legs onto itself, working modes aside
  bool keeps_modes = false;              // and the working modes too
};

// Images of the legs under one element.
ElementImage image_of_legs(const Mechanism& mechanism, const SymmetryGroup& group,
                           SymmetryElement element, const SymmetryTolerance& tolerance = {});

// Throws SymmetryMismatch that names element, leg, parameter and deviation, unless every element
// of the group maps the structure onto itself. Neither working modes nor sensors are asked for: a
// reflection of a 3-RRR flips its modes, and still belongs to its structure (Eq. 18); where an
// encoder has its zero is not part of it (conditions 4(5), 5(6) and 5(7)).
void verify_symmetry(const Mechanism& mechanism, const SymmetryGroup& group,
                     const SymmetryTolerance& tolerance = {});

// How a leg comes from another: `element` carries `reference`, with its working mode, onto it.
struct Carrier {
  Index reference = 0;
  SymmetryElement element;
};

// For each leg the first leg of its orbit, and the element that carries it there with the least
// deviation, of several that do so equally well the one that carries the sensor best; a leg that no
// element reaches is its own reference.
std::vector<Carrier> leg_carriers(const Mechanism& mechanism, const SymmetryGroup& group,
                                  const SymmetryTolerance& tolerance = {});

// G_C (Eqs. 7, 21): for each leg an element that carries the reference leg, leg 1, onto it with its
// working mode. Throws SymmetryMismatch if a leg has none.
std::vector<SymmetryElement> observability_group(const Mechanism& mechanism,
                                                 const SymmetryGroup& group,
                                                 const SymmetryTolerance& tolerance = {});

}  // namespace symkin
