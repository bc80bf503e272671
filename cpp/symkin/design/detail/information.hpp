// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/detail/blocks.hpp"

namespace symkin::design::detail {

// d_j of a block of candidates for A = T^T T, as below; `traces` starts at a cache line.
void compute_traces(const double* columns, Shape shape, const RowMatrix& factor, double* traces);

// d_j = trace(C_j A C_j^T) of candidates for A = T^T T, T lower triangular.
Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor);

// The products C_j A C_j^T of candidates with the inverse A of an information matrix.
class Products {
 public:
  explicit Products(const ColumnBlocks& candidates);  // which must outlive it

  void compute(const RowMatrix& factor);                 // A = T^T T, T lower triangular
  void update(const Vector& u, double scale);            // += scale (C_j u) (C_j u)^T
  void set(Index candidate, const RowMatrix& products);  // r x r
  void hide(Index candidate);                            // until it is set or all computed
  double trace(Index candidate) const { return trace_[candidate]; }  // d_j; negative if hidden
  RowMatrix of(Index candidate) const;                               // r x r
  double largest_trace() const;

  // The candidate that is best to take the place of `leaving`, if any is better than `best`.
  void best_pair(const Leaving& leaving, BestPair& best) const;

 private:
  // Kernels write through this where the products are not const.
  BlockProducts block(Index b) const;
  double* lane(Index candidate) const;  // of its first gram column

  const ColumnBlocks& x_;
  Index gram_size_;  // columns a block; none with one row
  mutable AlignedArray gram_, trace_, group_max_;
};

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

// Of a chosen pose with the rows C_i, for C_i A.
Leaving leaving_pose(const RowMatrix& rows, RowMatrix solved);

}  // namespace symkin::design::detail
