// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "symkin/model/pose_space.hpp"
#include "symkin/model/roles.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// p -> linear p + shift, proper or improper. In the plane z stays as it is.
struct Isometry {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // m

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const { return linear * point + shift; }
};

Isometry operator*(const Isometry& outer, const Isometry& inner);
Isometry inverse(const Isometry& isometry);

// Whether a linear part mirrors.
bool mirrors(const Eigen::Matrix3d& linear);

// One motion of the base space, g, and one of the platform's, h, both proper or both improper. A
// pair carries the pose X, platform to base, to g X h^-1; an exchange, in which base and platform
// change roles, to g X^-1 h. (X maps by its rotation and its position; the image is again a motion,
// also where g and h are not.)
struct SymmetryPair {
  Isometry base;
  Isometry platform;
  bool exchange = false;

  bool improper() const { return mirrors(base.linear); }
  bool is_identity() const;
};

// What `inner` does, then `outer`.
SymmetryPair compose(const SymmetryPair& outer, const SymmetryPair& inner);
SymmetryPair inverse(const SymmetryPair& pair);

// How far apart two are: of the matrices' entries and of the shifts in units of `size`, the largest
// difference; infinite between a pair and an exchange.
double apart(const SymmetryPair& a, const SymmetryPair& b, double size);

// Images of poses, one a row. A platform that does not turn follows the base's motion alone.
// Throws InvalidInput for another number of coordinates, or for an exchange where the platform does
// not turn.
RowMatrix transform_poses(const SymmetryPair& pair, PoseSpace space, ConstRows poses);

}  // namespace symkin
