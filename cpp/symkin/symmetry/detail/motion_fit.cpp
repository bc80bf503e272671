// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detail/motion_fit.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace symkin {
namespace {

using Eigen::Matrix3d;
using Svd = Eigen::JacobiSVD<Eigen::MatrixXd>;

double largest_singular(const Svd& svd) { return svd.singularValues()[0]; }

}  // namespace

Matrix3d fit_orthogonal(const VectorPairs& pairs, int determinant, double threshold,
                        const Matrix3d& otherwise) {
  Matrix3d sum = Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    sum += pairs.onto[i] * pairs.from[i].transpose();
  }
  const Svd svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Index rank = 0;
  // The sum has the squares of the vectors' singular values.
  while (rank < 3 && svd.singularValues()[rank] > threshold * threshold * largest_singular(svd) &&
         svd.singularValues()[rank] > 0) {
    ++rank;
  }
  const Matrix3d u = svd.matrixU();
  const Matrix3d v = svd.matrixV();
  const Index free = rank < 3 ? 3 - rank : 1;
  const double wanted = determinant * u.determinant() * v.determinant();
  // In what the vectors do not span, or in the direction in which they tell least.
  const Eigen::MatrixXd rest = u.rightCols(free).transpose() * otherwise * v.rightCols(free);
  const Svd of_rest(rest, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::VectorXd signs = Eigen::VectorXd::Ones(free);
  signs[free - 1] =
      wanted * of_rest.matrixU().determinant() * of_rest.matrixV().determinant() < 0 ? -1 : 1;
  Matrix3d turn = Matrix3d::Identity();
  turn.bottomRightCorner(free, free) =
      of_rest.matrixU() * signs.asDiagonal() * of_rest.matrixV().transpose();
  return u * turn * v.transpose();
}

int rank_of(const std::vector<Eigen::Vector3d>& vectors, double threshold) {
  Matrix3d square = Matrix3d::Zero();
  for (const Eigen::Vector3d& vector : vectors) {
    square += vector * vector.transpose();
  }
  const Svd svd(square);
  const double least = threshold * threshold * static_cast<double>(vectors.size());
  int rank = 0;
  while (rank < 3 && svd.singularValues()[rank] > least) {
    ++rank;
  }
  return rank;
}

Eigen::Vector3d nearest_point(const std::vector<Place>& places, const Eigen::Vector3d& start) {
  Matrix3d sum = Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Place& place : places) {
    sum += place.across;
    right += place.across * (place.point - start);
  }
  if (places.empty()) {
    return start;
  }
  Svd svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.setThreshold(1e-9);
  return start + svd.solve(right);
}

}  // namespace symkin
