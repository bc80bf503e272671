// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// The closures h of the legs that were read at one measured pose, L L' their covariance: L^-1 h is
// standard normal at the true parameters.
struct WhitenedPose {
  Index row;                // of the measurements
  std::vector<Index> legs;  // that were read, ascending
  Index closures;           // of each leg
  Index first;              // row of its first closure in the system
  RowMatrix units;          // L^-1, lower triangular

  Index count() const { return static_cast<Index>(legs.size()) * closures; }
};

// Closures of some legs, linearised and whitened pose by pose: one least-squares problem in those
// legs' parameters. Of one leg alone it is the problem of the estimator `implicit`, of all legs
// that of `joint`, from whose latent poses it is taken: of a pose that was measured in full there
// is left a condition for each closure.
struct WhitenedClosures : WhitenedSystem {
  std::vector<Index> legs;
  std::vector<WhitenedPose> poses;
  MeasurementSet at;                 // where they are linearised; readings of no other legs
  std::vector<ClosureRows> of_legs;  // at all of these

  // Where a leg's parameters begin in the columns of the jacobian, and where they all end.
  std::vector<Index> columns;
  std::vector<std::vector<Index>> estimated;  // of each of the legs, which of its parameters

  // Place of a leg among these.
  Index position(Index leg) const;
};

// Where the closures are linearised. Residuals are always those of what was measured.
enum class LinearisedAt {
  measured,
  // At the poses and readings which the closures make most likely at the parameters. To first order
  // these do not depend on the residuals; where the measured ones do, what little the noise changes
  // in the derivatives adds up with them instead of averaging out.
  likely,
};

// Throws InvalidInput, naming the pose, whose first is `numbered`, where the covariance of its
// closures is singular.
WhitenedClosures whiten_closures(const Mechanism& mechanism, const MeasurementSet& measurements,
                                 const std::vector<Index>& legs, const MeasurementNoise& noise,
                                 LinearisedAt where, Index numbered = 0);

// 0, 1, ..., count - 1
std::vector<Index> all_legs(Index count);

}  // namespace symkin
