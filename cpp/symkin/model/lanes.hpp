// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "symkin/support/types.hpp"

namespace symkin {

// What a scalar type of the kernels is besides its arithmetic: several poses side by side, one a
// lane. A double is one lane; batches specialise this (chains/batch_lanes.hpp).
template <typename T>
struct Lanes;

template <>
struct Lanes<double> {
  static constexpr int kCount = 1;
  using Mask = bool;

  static double select(bool mask, double yes, double no) { return mask ? yes : no; }
  static bool any(bool mask) { return mask; }
  static void cosine_sine(double angle, double& cosine, double& sine) {
    cosine = std::cos(angle);
    sine = std::sin(angle);
  }

  static double load(const double* from) { return *from; }
  static void store(double value, double* to) { *to = value; }
  // Values that stand `offsets` behind the address, one a lane.
  static double gather(const double* from, const Index* offsets) { return from[offsets[0]]; }
  static void scatter(double value, double* to, const Index* offsets) { to[offsets[0]] = value; }
  static bool lane(bool mask, int /*lane*/) { return mask; }
};

}  // namespace symkin
