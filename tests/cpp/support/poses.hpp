// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "symkin/model/mechanism.hpp"

namespace symkin::testing {

// Of any component of any pose, on the tangent.
inline double worst_difference(const Mechanism& mechanism, const RowMatrix& a, const RowMatrix& b) {
  double worst = 0;
  Vector difference(mechanism.dof());
  for (Index i = 0; i < a.rows(); ++i) {
    pose_difference(mechanism.pose_space(), a.row(i).data(), b.row(i).data(), difference.data());
    worst = std::max(worst, difference.cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace symkin::testing
