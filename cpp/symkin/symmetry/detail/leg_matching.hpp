// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/symmetry/detail/leg_features.hpp"
#include "symkin/symmetry/detail/motion_fit.hpp"
#include "symkin/symmetry/pairs.hpp"

namespace symkin {

// The features of one space, base or platform, of all legs, seen from their centre.
struct Side {
  std::vector<EndFeatures> legs;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double size = 1;     // m, the farthest feature from the centre
  double unit = 1e-6;  // m, what counts as one tolerance of a place
  int rank = 0;        // dimensions that the features span

  bool empty() const { return rank == 0; }
};

// What a search goes from and to: the same, or base and platform exchanged.
struct Matching {
  const Mechanism* mechanism;
  SymmetryTolerance tolerance;
  std::array<Side, 2> from, onto;
  Eigen::Matrix3d home = Eigen::Matrix3d::Identity();  // rotation of the platform
  bool exchange = false;
  bool turns = true;        // the platform; otherwise its motion is the base's
  bool proper = false;      // nothing but rotations
  double threshold = 1e-3;  // under which singular values are zero
};

Matching matching_of(const Mechanism& mechanism, ConstVector home,
                     const SymmetryTolerance& tolerance, bool exchange);

// Every way to carry the legs, each once.
std::vector<FoundPair> matched(const Matching& matching);

}  // namespace symkin
