// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/estimation/identification.hpp"

namespace symkin {

// What the measurements say of many robots of one drawing, a row a robot. Where nothing was found
// there is NaN, and `failures` says why.
struct Fleet {
  RowMatrix parameters;  // robots x (legs p), leg by leg
  RowMatrix deviations;  // robots x (legs p), standard deviations
  // Robots x fits: one a leg, or of `joint` one of all legs. See GoodnessOfFit.
  RowMatrix chi_square, degrees_of_freedom, limit, least;
  RowMatrix student_degrees;          // robots x legs, see LegIdentification
  Vector residual_rms;                // closures of all legs, metres
  Vector rejected;                    // readings whose robust weight fell below one half
  std::vector<std::string> failures;  // empty for robots whose every leg converged
};

// Identifies each robot by itself, as `identify` does. One that cannot be identified leaves the
// others alone; throws InvalidInput for what is wrong with all of them. On several threads (0: all)
// the result is the same.
Fleet identify_many(const Mechanism& mechanism, const std::vector<MeasuredRobot>& measured,
                    const IdentificationOptions& options = {}, int threads = 1);

}  // namespace symkin
