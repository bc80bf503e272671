// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// Measured poses with the sensor readings of all legs. A NaN reading was not taken.
struct MeasurementSet {
  RowMatrix poses;              // N x coordinates
  RowMatrix readings;           // N x legs
  std::vector<Index> leg_sets;  // N: the leg for which the pose was chosen, 0-based; -1: for all
};

// Which of the poses a leg uses.
enum class PoseUse {
  all,  // every pose at which it was read
  own,  // those chosen for it (the paper's divide and conquer), and those chosen for all legs
};

// Of a pose with such an entry of `leg_sets`.
inline bool uses(Index leg_set, Index leg, PoseUse use) {
  return use == PoseUse::all || leg_set == leg || leg_set < 0;
}

std::vector<Index> rows_of_leg(const MeasurementSet& measurements, Index leg, PoseUse use);
void rows_of_leg(const MeasurementSet& measurements, Index leg, PoseUse use,
                 std::vector<Index>& rows);

}  // namespace symkin
