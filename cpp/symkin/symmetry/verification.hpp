// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/mechanism.hpp"
#include "symkin/symmetry/group.hpp"

namespace symkin {

struct SymmetryTolerance {
  double length = 1e-6;  // m
  double angle = 1e-6;   // rad
  double gain = 1e-6;

  void check() const;  // throws InvalidInput
};

// How one leg's image differs from a leg of the mechanism, in units of the tolerance.
struct LegDeviation {
  Index leg = 0;             // whose image is compared
  Index nearest = 0;         // the leg that the image is nearest to
  std::string parameter;     // that deviates most; empty if nothing does
  double deviation = 0;      // of that parameter: m, rad or gain
  double in_tolerances = 0;  // the same over its tolerance; <= 1 means the leg maps
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

// Parameters of one leg less those of another, angles by the shortest turn.
Vector parameter_differences(const Leg& leg, const Leg& other, const ChainInfo& chain);

// Images of the legs under one element.
ElementImage image_of_legs(const Mechanism& mechanism, const SymmetryGroup& group,
                           SymmetryElement element, const SymmetryTolerance& tolerance = {});

// Throws SymmetryMismatch that names element, leg, parameter and deviation, unless every element
// of the group maps the structure onto itself. Working modes are not asked for: a reflection of a
// 3-RRR flips them, and still belongs to its structure (Eq. 18).
void verify_symmetry(const Mechanism& mechanism, const SymmetryGroup& group,
                     const SymmetryTolerance& tolerance = {});

// How a leg comes from another: `element` carries `reference`, with its working mode, onto it.
struct Carrier {
  Index reference = 0;
  SymmetryElement element;
};

// For each leg the first leg of its orbit, and the element that carries it there with the least
// deviation; a leg that no element reaches is its own reference.
std::vector<Carrier> leg_carriers(const Mechanism& mechanism, const SymmetryGroup& group,
                                  const SymmetryTolerance& tolerance = {});

// G_C (Eqs. 7, 21): for each leg an element that carries the reference leg, leg 1, onto it with its
// working mode. Throws SymmetryMismatch if a leg has none.
std::vector<SymmetryElement> observability_group(const Mechanism& mechanism,
                                                 const SymmetryGroup& group,
                                                 const SymmetryTolerance& tolerance = {});

}  // namespace symkin
