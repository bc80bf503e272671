// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/statistics/quadratic_form.hpp"

namespace symkin {

struct LargestErrorOptions {
  double probability = 0.95;
  double noise_degrees = kNoiseKnown;  // see QuadraticForm::quantile
  Index poses = 100;                   // of those where the error is largest on average
  Index draws = 10000;                 // the same ones always: a standard error of 0.4 to 0.7%
};

// What the largest error |E_j x| over poses j falls short of with a probability, x normal with mean
// zero and, as likely each, one of the covariances, which stand one below the other (see
// mixed_quantile). `effects` are the E_j, one below the other, `rows_per_pose` rows each, of as
// many errors in turn as `parts` says (position and orientation, say): an entry of each.
Vector largest_errors(ConstRows effects, Index rows_per_pose, Index parts, ConstRows covariances,
                      const LargestErrorOptions& options = {});

}  // namespace symkin
