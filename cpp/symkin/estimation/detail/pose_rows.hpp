// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// What one row of a latent pose is of.
struct RowOrigin {
  enum class Kind { closure, pose, reported, point, distance, height };
  Kind kind;
  Index index;      // the leg, the component of the tangent, the point's coordinate, the anchor
  double by_error;  // of a closure: dh/dpsi, its deviation per deviation of the reading
};

// What a fit says of the m rows of one latent pose, by r conditions rho = E'y on them: estimated
// errors -V E lambda, and the variances of the multipliers E lambda.
struct PoseRows {
  std::vector<RowOrigin> origins;
  Vector variances;      // V
  RowMatrix conditions;  // E, m x r
  RowMatrix precision;   // W, r x r, the inverse of the conditions' covariance
  RowMatrix left;        // W less what the estimate takes of it: W - W J C J' W
  Vector multipliers;    // lambda = W rho
};

}  // namespace symkin
