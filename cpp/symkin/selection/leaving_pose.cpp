// SPDX-License-Identifier: MIT
#include "symkin/selection/leaving_pose.hpp"

#include <Eigen/LU>

namespace symkin {
namespace {

// I - D_ii is singular if the others do not do without the pose; this keeps its inverse finite and
// the ratio right to as many digits.
constexpr double kRidge = 1e-9;

}  // namespace

LeavingPose::LeavingPose(const Information& information, const double* rows, Shape shape)
    : y_(shape.rows, shape.parameters) {
  for (Index row = 0; row < shape.rows; ++row) {
    information.multiply_inverse(rows + row * shape.parameters, y_.row(row).data());
  }
  const Eigen::Map<const RowMatrix> c(rows, shape.rows, shape.parameters);
  view_.y = y_.data();
  if (shape.rows == 1) {
    view_.trace = c.row(0).dot(y_.row(0));
    view_.base = 1 - view_.trace;
    return;
  }
  const RowMatrix d = c * y_.transpose();
  const RowMatrix rest = (1 + kRidge) * RowMatrix::Identity(shape.rows, shape.rows) - d;
  const Eigen::PartialPivLU<RowMatrix> lu(rest);
  s_ = lu.inverse();
  view_.trace = d.trace();
  view_.base = lu.determinant();
  view_.s = s_.data();
}

double LeavingPose::ratio(const Information& information, const double* rows, Shape shape) const {
  const Eigen::Map<const RowMatrix> c(rows, shape.rows, shape.parameters);
  const RowMatrix d = c * information.inverse() * c.transpose();
  const RowMatrix e = c * y_.transpose();
  if (shape.rows == 1) {
    return (1 + d(0, 0)) * view_.base + e(0, 0) * e(0, 0);
  }
  const RowMatrix bordered =
      RowMatrix::Identity(shape.rows, shape.rows) + d + e * s_ * e.transpose();
  return view_.base * bordered.determinant();
}

}  // namespace symkin
