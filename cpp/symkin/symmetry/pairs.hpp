// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/pair.hpp"
#include "symkin/symmetry/verification.hpp"

namespace symkin {

// What a pair does to the joint of a leg: q' = sign q + constant, in mode_factor times its mode.
struct JointMap {
  int sign = 1;
  int mode_factor = 1;
  double constant = 0;  // rad or m, as the joint; angles within half a turn
};

// A pair that carries the legs onto each other.
struct FoundPair {
  SymmetryPair pair;
  std::vector<Index> permutation;  // leg -> the leg onto which it goes
  std::vector<JointMap> joints;    // one a leg
  double in_tolerances = 0;        // the largest deviation of an image
  bool keeps_modes = false;        // every leg arrives in the mode of the leg where it arrives
  bool permutes_readings = false;  // sensors alike: psi' = sign psi, gains and offsets agree
};

// All pairs (g, h) that carry the mechanism onto itself, working modes and sensors aside: a group.
struct PairSymmetry {
  // The identity first, then proper pairs, improper ones, exchanges; a group together.
  std::vector<FoundPair> pairs;
  // All of that end lies on one line through its centre, so that any turn about it does the same:
  // one is listed of each, that which turns the platform as the base does, seen at `home`.
  bool continuous_base = false;
  bool continuous_platform = false;
};

// Finds them by matching legs, about any centres and axes, within the tolerance: an image may be
// off by kImageTolerances. `home`, a pose, decides between pairs that differ by a turn which does
// nothing. Legs that are the same seen from either end (U[P]S, R[P]R, R[R]R) may go with base and
// platform exchanged.
PairSymmetry find_pairs(const Mechanism& mechanism, ConstVector home,
                        const SymmetryTolerance& tolerance = {});

}  // namespace symkin
