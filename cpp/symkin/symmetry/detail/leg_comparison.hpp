// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/symmetry/verification.hpp"

namespace symkin {

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

// The hand of a declared leg that has a mirror image says how it stands, as a working mode does.
bool is_mode(const ChainInfo& chain, const ParameterInfo& parameter);

// Whether the hand of a leg is that of another, once mirrored where `sense` is -1; of a leg that is
// not declared always.
bool same_hand(const ChainInfo& chain, const Leg& leg, const Leg& other, int sense);

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
