// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/levenberg_marquardt.hpp"

#include <Eigen/Cholesky>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

constexpr double kPoorPivot = 1e-12;  // of a column of length one, squared
constexpr double kUnseen = 1e-12;     // eigenvalue of what the data does not show

}  // namespace

void ScaledSteps::set(const NormalEquations& equations) {
  const auto diagonal = equations.information.diagonal().array();
  scale_ = (diagonal > 0).select(diagonal.sqrt().inverse(), 1);
  gradient_ = scale_.cwiseProduct(equations.gradient);
  information_ = scale_.asDiagonal() * equations.information * scale_.asDiagonal();
}

ScaledSteps::Step ScaledSteps::solve(double damping, Vector& step) {
  factor_ = information_;
  factor_.diagonal().array() += damping;
  Eigen::LLT<Eigen::Ref<RowMatrix>> cholesky(factor_);
  const bool accurate = cholesky.info() == Eigen::Success &&
                        factor_.diagonal().array().square().minCoeff() > kPoorPivot;
  if (!accurate && damping == 0) {
    return shortest(step);
  }
  if (cholesky.info() != Eigen::Success) {
    return {-1, false};
  }
  step = cholesky.solve(gradient_);
  const double decrease = gradient_.dot(step) + damping * step.squaredNorm();
  step = -scale_.cwiseProduct(step);
  return {decrease, accurate};
}

ScaledSteps::Step ScaledSteps::shortest(Vector& step) const {
  if (!information_.allFinite()) {
    return {-1, false};
  }
  const SymmetricEigen eigen = symmetric_eigen(information_);
  const Vector inverse = (eigen.values.array() > kUnseen).select(eigen.values.array().inverse(), 0);
  const Vector along = eigen.vectors.transpose() * gradient_;
  const Vector shortest = eigen.vectors * inverse.cwiseProduct(along);
  step = -scale_.cwiseProduct(shortest);
  return {gradient_.dot(shortest), false};
}

}  // namespace symkin
