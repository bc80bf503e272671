// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "symkin/support/dense.hpp"

namespace symkin {

// A least-squares problem at one state: m whitened residuals and their derivatives by p columns, in
// blocks whose errors depend on each other, those of a pose; behind them rows that are in no block,
// such as priors.
struct WhitenedSystem {
  RowMatrix jacobian;  // m x p
  Vector residual;     // m
  // Where each block begins, and where the last one ends.
  std::vector<Index> first{0};

  Index count() const { return static_cast<Index>(first.size()) - 1; }
  Index rows() const { return first.back(); }  // of blocks
  Index conditions(Index block) const {
    const auto at = static_cast<std::size_t>(block);
    return first[at + 1] - first[at];
  }
  // Squared norms of the blocks' residuals after a change of the columns.
  Vector squares(const Vector& change) const;
};

// What the rows diag(factors) A of a least-squares problem, m x p, say of its columns: by their
// square with a diagonal of ones where that shows everything, and by orthogonal maps of the rows
// where squaring them costs more than half of the digits. Nothing here throws.
class LinearFit {
 public:
  LinearFit() = default;
  LinearFit(const RowMatrix& by_parameters, const Vector& factors) {
    reset(by_parameters, factors);
  }
  // The rows outlive it. Anew in the same room.
  void reset(const RowMatrix& by_parameters, const Vector& factors);
  // Of the square of rows that are made only if they are asked; of `sizes` that directions are
  // compared in. What the square shows to be unseen it shows to half of the digits: to all of them
  // with `by_rows`. It has neither leverages nor residuals. Its decomposition may be known.
  LinearFit(RowMatrix square, const Vector& sizes, const std::function<RowMatrix()>& rows,
            bool by_rows = false, const ScaledCholesky* known = nullptr);

  // Whether the columns are so far from dependent that the square shows it.
  bool clear() const { return is_clear(least_pivot_); }
  static bool is_clear(double least_pivot);
  Index rank() const { return square_.rows() - unseen_.cols(); }
  // Directions that no row shows, p x (p - rank): orthonormal in sizes (by default the columns'
  // lengths), or easy to name and in the columns' own units.
  const RowMatrix& unseen() const { return unseen_; }
  RowMatrix named_unseen() const;
  // Ratio of the largest and the smallest singular value; infinite if something is unseen.
  double condition() const;

  // Of the least-squares estimate. Where something is unseen, of the one that rows `held`, as many
  // as there are such directions, take to zero; infinite without them.
  RowMatrix covariance(const RowMatrix& held = {}) const;
  // How the estimate answers to errors of the rows of A, p x m.
  RowMatrix influence() const;
  // What of each row its own error makes the fit follow.
  Vector leverages() const;
  // Squares of a residual (m) that a change of the columns explains.
  double explained(const Vector& residual) const;

 private:
  void look(const Vector& sizes, const std::function<RowMatrix()>& rows);
  RowMatrix rows() const { return factors_.asDiagonal() * *by_parameters_; }

  const RowMatrix* by_parameters_ = nullptr;
  Vector factors_;
  RowMatrix square_;  // of the rows
  // Of the square, or of the square with what is unseen clearly.
  ScaledCholesky cholesky_;
  double least_pivot_ = 0;
  // Where it is not clear.
  Vector sizes_;
  RowMatrix unseen_;
  RowMatrix half_;  // p x rank: the rows times these are orthonormal; empty where Cholesky will do
  double condition_ = std::numeric_limits<double>::infinity();
};

}  // namespace symkin
