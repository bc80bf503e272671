// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/levenberg_marquardt.hpp"

namespace symkin {
namespace {

constexpr double kPoorPivot = 1e-12;  // of a column of length one, squared
constexpr double kUnseen = 1e-12;     // eigenvalue of what the data does not show

double shortest(const NormalEquations& equations, const Vector& scale, Vector& step) {
  if (!equations.information.allFinite()) {
    return -1;
  }
  const SymmetricEigen eigen =
      symmetric_eigen(scale.asDiagonal() * equations.information * scale.asDiagonal());
  const Vector inverse = (eigen.values.array() > kUnseen).select(eigen.values.array().inverse(), 0);
  const Vector along = eigen.vectors.transpose() * scale.cwiseProduct(equations.gradient);
  step = -scale.cwiseProduct(eigen.vectors * inverse.cwiseProduct(along));
  return -equations.gradient.dot(step);
}

}  // namespace

void NormalSteps::decompose(const NormalEquations& equations, double damping) {
  damping_ = damping;
  cholesky_.compute(equations.information, damping);
}

double NormalSteps::solve_decomposed(const NormalEquations& equations, Vector& step) const {
  return damping_ == 0 && poor() ? shortest(equations, cholesky_.scale(), step)
                                 : solve_again(equations.gradient, step);
}

bool NormalSteps::poor() const {
  return cholesky_.least_pivot() <= (damping_ == 0 ? kPoorPivot : 0);
}

double NormalSteps::solve_again(const Vector& gradient, Vector& step) const {
  if (poor()) {
    return -1;
  }
  cholesky_.solve(gradient, step);
  const double damped =
      damping_ == 0 ? 0 : damping_ * step.cwiseQuotient(cholesky_.scale()).squaredNorm();
  const double decrease = gradient.dot(step) + damped;
  step = -step;
  return decrease;
}

}  // namespace symkin
