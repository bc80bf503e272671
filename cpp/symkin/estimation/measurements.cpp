// SPDX-License-Identifier: MIT
#include "symkin/estimation/measurements.hpp"

#include <cmath>

namespace symkin {

void rows_of_leg(const MeasuredRobot& measured, Index legs, Index leg, PoseUse use,
                 std::vector<Index>& rows) {
  rows.clear();
  for (Index row = 0; row < measured.count; ++row) {
    const Index set = measured.leg_sets[row];
    if ((use == PoseUse::all || set == leg || set < 0) &&
        std::isfinite(measured.readings[row * legs + leg])) {
      rows.push_back(row);
    }
  }
}

}  // namespace symkin
