// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/dense.hpp"

namespace symkin {

// Directions of the columns over `scale` that the rows (m x p) do not show, orthonormal.
struct NullSpace {
  double condition;  // of what they show; infinite if there are any
  RowMatrix directions;
  Index rank() const { return directions.rows() - directions.cols(); }
};
NullSpace null_space(const RowMatrix& rows, const Vector& scale);

// What the rows diag(factors) A of a least-squares problem, n x p, say of its parameters, computed
// with columns of length one. Nothing here throws.
class LinearFit {
 public:
  LinearFit() = default;
  LinearFit(const RowMatrix& by_parameters, const Vector& factors) {
    reset(by_parameters, factors);
  }
  // The rows outlive it. Anew in the same room.
  void reset(const RowMatrix& by_parameters, const Vector& factors);

  // Whether the columns are so far from dependent that the normal equations show it.
  bool clear() const { return is_clear(cholesky_.least_pivot()); }
  static bool is_clear(double least_pivot);
  Index rank() const { return clear() ? square_.rows() : space_.rank(); }
  // Of the least-squares estimate; infinite if the columns are dependent.
  RowMatrix covariance() const;
  Vector variances() const;
  // What of each row its own error makes the fit follow.
  Vector leverages() const;
  // Squares of a residual (n) that a change of the parameters explains.
  double explained(const Vector& residual) const;
  // Ratio of the largest and the smallest singular value, and combinations of parameters, in their
  // own units, p x (p - rank), that no row sees. The ratio is infinite if there are any.
  struct Conditioning {
    double condition;
    RowMatrix unseen;
  };
  Conditioning conditioning() const;

 private:
  RowMatrix rows() const { return factors_.asDiagonal() * *by_parameters_; }

  const RowMatrix* by_parameters_ = nullptr;
  Vector factors_;
  RowMatrix square_;  // of the rows
  ScaledCholesky cholesky_;
  ColumnSpace space_;  // of what is not clear, with columns of length one
};

}  // namespace symkin
