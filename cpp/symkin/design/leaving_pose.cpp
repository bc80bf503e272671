// SPDX-License-Identifier: MIT
#include "symkin/design/leaving_pose.hpp"

#include <Eigen/LU>

namespace symkin {
namespace {

// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;

}  // namespace

void LeavingPose::prepare(const Information& information, const double* rows) {
  trace_ = 0;
  for (Index row = 0; row < shape_.rows; ++row) {
    const double* c = rows + row * shape_.parameters;
    double* y = y_.data() + row * shape_.parameters;
    information.multiply_inverse(c, y);
    for (Index a = 0; a < shape_.parameters; ++a) {
      trace_ += c[a] * y[a];
    }
  }
  if (shape_.rows == 1) {
    base_ = 1 - trace_;
    return;
  }
  const Eigen::Map<const RowMatrix> c(rows, shape_.rows, shape_.parameters);
  const RowMatrix rest =
      (1 + kRidge) * RowMatrix::Identity(shape_.rows, shape_.rows) - c * y_.transpose();
  const Eigen::PartialPivLU<RowMatrix> lu(rest);
  s_ = lu.inverse();
  base_ = lu.determinant();
}

double LeavingPose::ratio(const Information& information, const double* rows) const {
  const Eigen::Map<const RowMatrix> c(rows, shape_.rows, shape_.parameters);
  const RowMatrix d = c * information.inverse() * c.transpose();
  const RowMatrix e = c * y_.transpose();
  if (shape_.rows == 1) {
    return (1 + d(0, 0)) * base_ + e(0, 0) * e(0, 0);
  }
  const RowMatrix bordered =
      RowMatrix::Identity(shape_.rows, shape_.rows) + d + e * s_ * e.transpose();
  return base_ * bordered.determinant();
}

}  // namespace symkin
