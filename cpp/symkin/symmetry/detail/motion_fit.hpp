// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// Columns of vectors, from and onto.
struct VectorPairs {
  std::vector<Eigen::Vector3d> from, onto;
};

// The orthogonal map of that determinant, +1 or -1, that carries vectors nearest to their partners
// (Kabsch). Directions that fewer than three vectors do not span, by singular values under
// `threshold` of the largest, are carried as near to `otherwise`, a map of that determinant, as it
// goes.
Eigen::Matrix3d fit_orthogonal(const VectorPairs& pairs, int determinant, double threshold,
                               const Eigen::Matrix3d& otherwise);

// How many dimensions vectors span: singular values above `threshold` times the root of their
// number.
int rank_of(const std::vector<Eigen::Vector3d>& vectors, double threshold);

// x with the least sum of |P (x - points)|^2, P = 1 - direction direction^T, nearest to `start`
// where it is not unique. A direction of zero takes all of the distance.
struct Place {
  Eigen::Vector3d point;
  Eigen::Matrix3d across;  // P
};
Eigen::Vector3d nearest_point(const std::vector<Place>& places, const Eigen::Vector3d& start);

}  // namespace symkin
