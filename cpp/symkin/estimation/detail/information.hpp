// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/dense.hpp"

namespace symkin {

// What the rows diag(factors) A of a least-squares problem, n x p, say of its parameters, computed
// with columns of length one. Nothing here throws.
class Information {
 public:
  Information() = default;
  Information(const RowMatrix& by_parameters, const Vector& factors) {
    reset(by_parameters, factors);
  }
  // The rows outlive it. Anew in the same room; or of rows whose square is known, lower triangle,
  // with its decomposition.
  void reset(const RowMatrix& by_parameters, const Vector& factors);
  void reset(const RowMatrix& by_parameters, const Vector& factors, const RowMatrix& square,
             const ScaledCholesky& cholesky);

  // Whether the columns are so far from dependent that the normal equations show it.
  bool clear() const { return is_clear(cholesky_.least_pivot()); }
  static bool is_clear(double least_pivot);
  Index rank() const { return clear() ? square_.rows() : space_.rank(); }
  // Of the covariance of the least-squares estimate; infinite if the columns are dependent.
  RowMatrix inverse() const;
  Vector inverse_diagonal() const;
  // Squares of a residual (n) that a change of the parameters explains.
  double explained(const Vector& residual) const;
  // Ratio of the largest and the smallest singular value, and combinations of parameters, in their
  // own units, p x (p - rank), that no row sees. The ratio is infinite if there are any.
  struct Sight {
    double condition;
    RowMatrix unseen;
  };
  Sight sight() const;

 private:
  RowMatrix rows() const { return factors_.asDiagonal() * *by_parameters_; }
  void look_closer();

  const RowMatrix* by_parameters_ = nullptr;
  Vector factors_;
  RowMatrix square_;  // of the rows
  ScaledCholesky cholesky_;
  ColumnSpace space_;  // of what is not clear, with columns of length one
};

}  // namespace symkin
