// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "symkin/model/mechanism.hpp"

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

// What counts as one tolerance. An error of an angle moves a joint by as much as the joint is far
// from the origin, and the centre of all joints with it, on which each is compared: the farthest
// joint sets the unit for all.
struct ComparisonUnits {
  double length, angle, gain;
  double base, platform;  // of where an end is, m
};

ComparisonUnits comparison_units(const Mechanism& mechanism, const SymmetryTolerance& tolerance);

// Parameters of one leg less those of another, angles by the shortest turn, in the polar
// coordinates of the first that are nearest to the second's. An angle at radius zero does not
// differ.
Vector parameter_differences(const Leg& leg, const Leg& other, const ChainInfo& chain);

// The same leg with distances of guides that are not negative: (-d, a) is the line (d, a + pi),
// with travel and working mode counted the other way.
Leg with_guides_outward(const Leg& leg, const ChainInfo& chain);

// The structure's parameter, gain and offset apart, by which `leg` differs most from an image.
LegDeviation compare_structure(const Leg& image, const Leg& leg, const ChainInfo& chain,
                               const ComparisonUnits& units);

// The largest difference of a single parameter of the structure, in tolerances: which of several
// images explains a leg best, where compare_structure says whether one does at all.
double structure_apart(const Leg& image, const Leg& leg, const ChainInfo& chain,
                       const ComparisonUnits& units);

// The same of gain and offset.
double sensors_apart(const Leg& image, const Leg& leg, const ChainInfo& chain,
                     const ComparisonUnits& units);

}  // namespace symkin
