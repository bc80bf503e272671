// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include "symkin/design/detail/blocks.hpp"

namespace symkin::design::detail {

// For A = T^T T, T lower triangular, of a block of candidates: d_j = trace(C_j A C_j^T) and, unless
// it is null, the lower triangle of C_j A C_j^T by rows.
void compute_products(const double* columns, Shape shape, const RowMatrix& factor, double* traces,
                      double* gram = nullptr);

// d_j of all candidates.
Vector variances(const ColumnBlocks& candidates, const RowMatrix& factor);

// A pose that may leave the selection. The ratio of the determinants after and before the exchange
// for candidate j is base * det(I + D_jj + E S E^T), E = X_j Y^T.
struct Leaving {
  RowMatrix y;   // rows x parameters: C_i A, in the coordinates of x
  RowMatrix s;   // rows x rows: (I - D_ii)^-1; empty with one row
  double base;   // det(I - D_ii)
  double trace;  // d_i
};

// Of a chosen pose with the rows C_i, for C_i A.
Leaving leaving_pose(const RowMatrix& rows, RowMatrix solved);

// The best exchange so far; `candidate` is set only where a better one is found.
struct BestPair {
  double ratio = 1;
  Index candidate = -1;
};

// A += the sum of scale_k u_k u_k^T, u_k a row of u.
struct InverseChange {
  RowMatrix u;
  Vector scale;
};

// The products D_jj = C_j A C_j^T of candidates with the inverse A of an information matrix.
class Products {
 public:
  explicit Products(const ColumnBlocks& candidates);  // which must outlive it

  void compute(const RowMatrix& factor);  // A = T^T T, T lower triangular
  void update(const InverseChange& change);
  void set(Index candidate, const RowMatrix& products);  // r x r
  void hide(Index candidate);                            // until it is set or all computed
  double trace(Index candidate) const { return trace_[candidate]; }  // d_j; negative if hidden
  RowMatrix of(Index candidate) const;                               // r x r
  Index largest() const;  // the first candidate of largest trace

  // log det(I + sign D_jj): what log det M gains or loses with the candidate.
  double log_ratio(Index candidate, double sign) const;

  // The first of the allowed candidates that add most to log det M; negative if there is none.
  Index best_addition(const std::function<bool(Index)>& allowed) const;

  // The candidate that is best to take the place of `leaving`, if any is better than `best`.
  void best_pair(const Leaving& leaving, BestPair& best) const;

 private:
  Index lane(Index candidate) const;  // where its first gram value is
  double* gram(Index block);          // none with one row, where it would be the trace

  const ColumnBlocks& x_;
  Index gram_size_;  // columns a block: the lower triangle, by rows; none with one row
  AlignedArray gram_, trace_;
  RowMatrix hidden_;
  std::vector<double> group_max_;  // the largest trace of each group
};

// An information matrix M (p x p) with its inverse and log-determinant, kept by rank-one updates.
class Information {
 public:
  Information() = default;
  explicit Information(RowMatrix matrix) { reset(std::move(matrix)); }

  void reset(RowMatrix matrix);

  // M += weight x^T x for each row x (count x p); returns what products with the inverse follow by.
  // The inverse is computed afresh where the update would lose digits, and every some tens of
  // updates. Rows should be added before others are taken away.
  InverseChange add(const double* rows, Index count, double weight);

  bool positive_definite() const { return positive_definite_; }
  const RowMatrix& matrix() const { return matrix_; }
  const RowMatrix& inverse() const { return inverse_; }
  double log_det() const { return log_det_; }  // -infinity unless positive definite

 private:
  void refresh();

  RowMatrix matrix_, inverse_;
  double log_det_ = 0;
  int updates_ = 0;
  bool positive_definite_ = false;
};

}  // namespace symkin::design::detail
