// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// The mechanism as the workshop may make it: every parameter with a normal error.
Mechanism disturb(const Mechanism& nominal, const Tolerances& tolerances, std::uint64_t seed);

// The poses to be measured for one leg (0-based; -1: for all legs): the first `wanted` rows, and
// behind them spares in the order in which they replace poses that cannot be measured. So many
// rows are `together`: a pair of which one pose cannot be measured is replaced by another pair.
struct PoseSet {
  Index leg = -1;
  RowMatrix poses;
  Index wanted = 0;
  Index together = 1;
  RowMatrix readings = {};  // that the joints are told, instead of the model's at the poses
};

struct Simulation {
  MeasurementSet measurements;
  std::vector<Index> rows;      // of each measured pose, in its set
  std::vector<Index> replaced;  // for each set, how many wanted poses could not be measured
};

// What a laboratory would measure (section 6.5 of the paper): the commanded poses go through the
// model's inverse kinematics to the joints, the actual mechanism's forward kinematics gives the
// pose that it takes, and noise is added. A pose that the actual mechanism cannot take, or only
// beyond a singularity, is replaced by the set's next spare and counted. Throws InvalidInput if a
// set runs out of spares, wants more poses than it has or a part of those that are together, or is
// for a leg that does not exist.
Simulation simulate(const Mechanism& actual, const Mechanism& model,
                    const std::vector<PoseSet>& sets, const MeasurementNoise& noise,
                    std::uint64_t seed);

}  // namespace symkin
