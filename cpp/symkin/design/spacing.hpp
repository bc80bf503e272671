// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// The demand that selected poses keep a distance from each other.
class Spacing {
 public:
  Spacing(const RowMatrix& coordinates, double minimum_distance)
      : coordinates_(coordinates), squared_(minimum_distance * minimum_distance) {}

  bool active() const { return squared_ > 0; }

  // Whether the two candidates may not both be selected.
  bool conflict(Index a, Index b) const {
    return active() && a != b &&
           (coordinates_.row(a) - coordinates_.row(b)).squaredNorm() < squared_;
  }

  bool fits(Index candidate, const std::vector<Index>& chosen) const {
    for (const Index other : chosen) {
      if (conflict(candidate, other)) {
        return false;
      }
    }
    return true;
  }

 private:
  const RowMatrix& coordinates_;
  double squared_;
};

}  // namespace symkin
