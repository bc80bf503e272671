// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pose_elimination.hpp"

#include <Eigen/QR>
#include <string>

#include "symkin/support/error.hpp"

namespace symkin {

PoseElimination eliminate_pose(const Eigen::MatrixXd& by_pose, const Vector& variances,
                               Index pose) {
  constexpr double kRank = 1e-9;
  constexpr double kRedundant = 1e-12;
  const Index m = by_pose.rows();
  const Index n = by_pose.cols();
  if (m == 0) {  // Eigen reads past the end of a matrix without rows
    return {Eigen::MatrixXd(0, 0), Eigen::MatrixXd(n, 0)};
  }
  // Rows of length one: ranks shall not depend on units.
  Vector scale(m);
  for (Index i = 0; i < m; ++i) {
    const double length = by_pose.row(i).norm();
    scale[i] = length > 0 ? 1 / length : 1;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  qr.setThreshold(kRank);
  qr.compute(scale.asDiagonal() * by_pose);
  const Index rank = qr.rank();
  const Index r = m - rank;

  PoseElimination result;
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(m, m);
  // Least norm where a direction of the pose is shown by no row.
  Eigen::MatrixXd onto = Eigen::MatrixXd::Zero(n, m);
  if (rank == n) {
    onto = qr.matrixR().topRows(n).triangularView<Eigen::Upper>().solve(q.leftCols(n).transpose());
    onto = qr.colsPermutation() * onto;
  } else if (rank > 0) {
    const Eigen::MatrixXd top = qr.matrixR().topRows(rank).template triangularView<Eigen::Upper>();
    const Eigen::MatrixXd gram = top * top.transpose();
    onto = top.transpose() * gram.ldlt().solve(q.leftCols(rank).transpose());
    onto = qr.colsPermutation() * onto;
  }
  result.solution = onto * scale.asDiagonal();
  if (r == 0) {
    result.conditions.resize(m, 0);
    return result;
  }
  const Eigen::MatrixXd left = q.rightCols(r);
  // Of the rows' own deviations: squaring them into a covariance would lose half of the digits.
  const Vector deviations = scale.cwiseProduct(variances.cwiseSqrt());
  Eigen::HouseholderQR<Eigen::MatrixXd> noise(deviations.asDiagonal() * left);
  const Eigen::MatrixXd upper = noise.matrixQR().topRows(r).triangularView<Eigen::Upper>();
  const Vector pivots = upper.diagonal().cwiseAbs();
  if (!(pivots.minCoeff() > kRedundant * pivots.maxCoeff())) {
    throw InvalidInput("pose " + std::to_string(pose + 1) +
                       ": more exact observations than the pose has degrees of freedom (more legs "
                       "than degrees of freedom, or a singular pose); declare a noise of the "
                       "readings above zero");
  }
  result.conditions =
      scale.asDiagonal() *
      upper.transpose().triangularView<Eigen::Lower>().solve(left.transpose()).transpose();
  return result;
}

}  // namespace symkin
