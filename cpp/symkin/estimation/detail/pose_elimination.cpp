// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pose_elimination.hpp"

#include <string>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {

void throw_singular(Index pose, bool always) {
  const std::string named = "pose " + std::to_string(pose + 1);
  if (always) {
    throw InvalidInput(named +
                       " has more exact readings than degrees of freedom; declare a noise of the "
                       "readings above zero");
  }
  throw FailedFit(named + " is singular, as estimated");
}

PoseElimination eliminate_pose(const RowMatrix& by_pose, const Vector& variances, Index pose) {
  constexpr double kRank = 1e-9;
  constexpr double kRedundant = 1e-12;
  const Index m = by_pose.rows();
  // Rows of length one: ranks shall not depend on units.
  Vector scale(m);
  for (Index i = 0; i < m; ++i) {
    const double length = by_pose.row(i).norm();
    scale[i] = length > 0 ? 1 / length : 1;
  }
  const auto [onto, left] = pseudo_inverse(scale.asDiagonal() * by_pose, kRank);
  PoseElimination result;
  result.solution = onto * scale.asDiagonal();
  if (left.cols() == 0) {
    result.conditions.resize(m, 0);
    return result;
  }
  // Of the rows' own deviations: squaring them into a covariance would lose half of the digits.
  const Vector deviations = scale.cwiseProduct(variances.cwiseSqrt());
  const RowMatrix upper = triangular_factor(deviations.asDiagonal() * left);
  const Vector pivots = upper.diagonal().cwiseAbs();
  if (!(pivots.minCoeff() > kRedundant * pivots.maxCoeff())) {
    const Index exact = (variances.array() == 0).count();
    throw_singular(pose, exact > by_pose.cols());
  }
  result.conditions =
      scale.asDiagonal() * lower_solution(upper.transpose(), left.transpose()).transpose();
  return result;
}

}  // namespace symkin
