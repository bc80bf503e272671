// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/detail/products.hpp"

namespace symkin::design::detail {

// An information matrix M (p x p) with its inverse and log-determinant, kept by rank-one updates.
class Information {
 public:
  Information() = default;
  explicit Information(RowMatrix matrix) { reset(std::move(matrix)); }

  void reset(RowMatrix matrix);

  // M += weight x^T x for each row x (count x p), and the products follow. The inverse is computed
  // afresh where the update would lose digits, and every some tens of updates. Rows should be added
  // before others are taken away.
  void add(const double* rows, Index count, double weight, Products* products = nullptr);

  bool positive_definite() const { return positive_definite_; }
  const RowMatrix& matrix() const { return matrix_; }
  const RowMatrix& inverse() const { return inverse_; }
  double log_det() const { return log_det_; }  // -infinity unless positive definite

 private:
  void refresh();

  RowMatrix matrix_, inverse_;
  Vector work_;
  double log_det_ = 0;
  int updates_ = 0;
  bool positive_definite_ = false;
};

}  // namespace symkin::design::detail
