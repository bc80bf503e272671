// SPDX-License-Identifier: MIT
#include "symkin/estimation/measurements.hpp"

#include <cmath>

namespace symkin {

void rows_of_leg(const MeasuredRobot& measured, Index legs, Index leg, PoseUse use,
                 std::vector<Index>& rows) {
  rows.resize(static_cast<std::size_t>(measured.count));
  std::size_t taken = 0;
  for (Index row = 0; row < measured.count; ++row) {
    const Index set = measured.leg_sets[row];
    rows[taken] = row;
    taken += (use == PoseUse::all || set == leg || set < 0) &&
                     std::isfinite(measured.readings[row * legs + leg])
                 ? 1
                 : 0;
  }
  rows.resize(taken);
}

}  // namespace symkin
