// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// A latent pose eliminated from the rows y + B x + C d + v = 0 that it is in, v ~ (0, diag V), x
// the pose's tangent and d a step of the parameters: what is left are r conditions, standard normal
// at the truth, rho + J d = 0 with rho = G'y and J = G'C. The pose follows from the rest,
// x = A (-y - C d - v) with v = -V G (rho + J d).
struct PoseElimination {
  RowMatrix conditions;  // G, m x r
  RowMatrix solution;    // A, n_x x m; least norm along what no row shows
};

// Conditions of a pose have no covariance: always, which is InvalidInput, or where the fit has come
// to, which is a FailedFit.
[[noreturn]] void throw_singular(Index pose, bool always);

// B is m x n_x. Rows may be exact (V = 0) as long as no combination of exact rows is free of the
// pose; throws as `throw_singular` does otherwise.
PoseElimination eliminate_pose(const RowMatrix& by_pose, const Vector& variances, Index pose);

}  // namespace symkin
