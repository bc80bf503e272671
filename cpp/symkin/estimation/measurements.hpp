// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/mechanism.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// Measured poses with the sensor readings of all legs. A NaN reading was not taken.
struct MeasurementSet {
  RowMatrix poses;              // N x coordinates
  RowMatrix readings;           // N x legs
  std::vector<Index> leg_sets;  // N: the leg for which the pose was chosen, 0-based; -1: for all
};

// The same row by row, held by somebody else. Nothing can check arrays that are given by their
// addresses.
struct MeasuredRobot {
  Index count;
  const double* poses;     // count x coordinates
  const double* readings;  // count x legs
  const Index* leg_sets;   // count

  // The measurements outlive it. Throws InvalidInput where their shapes are not the mechanism's.
  static MeasuredRobot of(const Mechanism& mechanism, const MeasurementSet& measurements);
};

// Which of the poses a leg uses.
enum class PoseUse {
  all,  // every pose at which it was read
  own,  // those chosen for it (the paper's divide and conquer), and those chosen for all legs
};

// The rows that a leg uses, ascending; the robot has so many legs.
void rows_of_leg(const MeasuredRobot& measured, Index legs, Index leg, PoseUse use,
                 std::vector<Index>& rows);

}  // namespace symkin
