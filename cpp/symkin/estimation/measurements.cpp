// SPDX-License-Identifier: MIT
#include "symkin/estimation/measurements.hpp"

#include <cmath>
#include <string>

#include "symkin/support/error.hpp"

namespace symkin {

MeasuredRobot MeasuredRobot::of(const Mechanism& mechanism, const MeasurementSet& measurements) {
  const Index count = measurements.poses.rows();
  check_poses(mechanism, measurements.poses);
  check_readings(mechanism, count, measurements.readings);
  if (static_cast<Index>(measurements.leg_sets.size()) != count) {
    throw InvalidInput("leg_sets has " + std::to_string(measurements.leg_sets.size()) +
                       " entries; expected one a pose, " + std::to_string(count));
  }
  return {count, measurements.poses.data(), measurements.readings.data(),
          measurements.leg_sets.data()};
}

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
