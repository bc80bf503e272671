// SPDX-License-Identifier: MIT
#include "symkin/estimation/measurements.hpp"

#include <cmath>

namespace symkin {

std::vector<Index> rows_of_leg(const MeasurementSet& measurements, Index leg, PoseUse use) {
  std::vector<Index> rows;
  rows_of_leg(measurements, leg, use, rows);
  return rows;
}

void rows_of_leg(const MeasurementSet& measurements, Index leg, PoseUse use,
                 std::vector<Index>& rows) {
  rows.clear();
  for (Index i = 0; i < measurements.poses.rows(); ++i) {
    if (uses(measurements.leg_sets[static_cast<std::size_t>(i)], leg, use) &&
        std::isfinite(measurements.readings(i, leg))) {
      rows.push_back(i);
    }
  }
}

}  // namespace symkin
