// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// T, lower triangular, with T^T T the inverse of a positive definite matrix; empty if it is not.
RowMatrix inverse_factor(const RowMatrix& matrix);
// The same; throws InvalidInput where there is none.
RowMatrix demanded_factor(const RowMatrix& matrix);

// -2 sum log T_ii: the log-determinant of the matrix that T is the factor of.
double log_determinant(const RowMatrix& factor);

// An information matrix M (p x p) with its inverse and log-determinant, kept by rank-one updates.
class Information {
 public:
  Information() = default;
  explicit Information(RowMatrix matrix) { reset(std::move(matrix)); }

  void reset(RowMatrix matrix);

  // M += weight x^T x for each row x. The inverse is computed afresh where the update would lose
  // digits, and every some tens of updates. Rows should be added before others are taken away.
  void add(const double* rows, Index count, double weight);

  bool positive_definite() const { return positive_definite_; }
  const RowMatrix& matrix() const { return matrix_; }
  const RowMatrix& inverse() const { return inverse_; }
  double log_det() const { return log_det_; }  // -infinity unless positive definite

  // result = M^-1 x
  void multiply_inverse(const double* x, double* result) const;

 private:
  void refresh();

  RowMatrix matrix_, inverse_;
  Vector work_;
  double log_det_ = 0;
  int updates_ = 0;
  bool positive_definite_ = false;
};

}  // namespace symkin
