// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

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

// B is m x n_x. Rows may be exact (V = 0) as long as no combination of exact rows is free of the
// pose; throws InvalidInput, naming the pose, otherwise.
PoseElimination eliminate_pose(const RowMatrix& by_pose, const Vector& variances, Index pose);

// The same of poses that rows couple, B of their tangents one behind the other, `dof` each, with
// `hubs` among them, by places, that are in many rows: what these leave apart is eliminated first,
// piece by piece, and the hubs from what is left of that. The cost is of the square of the poses,
// while that of all together is of their cube; G differs by an orthogonal map of its columns.
PoseElimination eliminate_poses(const RowMatrix& by_pose, const Vector& variances, Index dof,
                                const std::vector<Index>& hubs, Index pose);

}  // namespace symkin
