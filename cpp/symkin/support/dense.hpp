// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "symkin/support/types.hpp"

namespace symkin {

// The decompositions of small dense matrices that the library uses, compiled once. Nothing here
// throws: what does not exist is empty, and values that are not finite give values that are not.

// A = V diag(values) V^T of a symmetric matrix, of which the lower triangle is read; the values
// ascend, the vectors are the columns of V.
struct SymmetricEigen {
  Vector values;
  RowMatrix vectors;
};
SymmetricEigen symmetric_eigen(const RowMatrix& matrix);
Vector symmetric_eigenvalues(const RowMatrix& matrix);

// L, lower triangular, with L L^T = A, a symmetric matrix of which the lower triangle is read;
// empty if A is not positive definite to rounding.
RowMatrix cholesky_factor(const RowMatrix& matrix);

// T, lower triangular, with T^T T the inverse of a positive definite matrix (the inverse of its
// Cholesky factor); empty if it is not positive definite to rounding.
RowMatrix inverse_factor(const RowMatrix& matrix);

// The Cholesky decomposition of a symmetric matrix M whose rows and columns are brought to a
// diagonal of ones first, so that pivots show how far from dependent they are, whatever their
// units.
class ScaledCholesky {
 public:
  // Of the lower triangle of M, its diagonal raised by `damping` times itself.
  void compute(const RowMatrix& matrix, double damping = 0);

  // What is left of a diagonal of ones, at the least; 0 if M is not positive definite.
  double least_pivot() const { return least_pivot_; }
  const Vector& scale() const { return scale_; }  // 1 / root of the diagonal, 1 for a zero
  // The rest only where the least pivot is above zero.
  void solve(const Vector& right, Vector& solution) const;  // M solution = right
  double inverse_form(const Vector& vector) const;          // v' M^-1 v
  RowMatrix inverse() const;

 private:
  void forwards(Vector& vector) const;  // by the inverse of the factor

  Vector scale_;
  RowMatrix factor_;  // lower triangular, with one over its diagonal, and mirrored above
  double least_pivot_ = 0;
};

// The lower triangle of A' diag(weights) A, weights of the rows; zeros above.
void weighted_square(const RowMatrix& matrix, const Vector& weights, RowMatrix& square);
// And A' diag(weights) right beside it.
void weighted_square(const RowMatrix& matrix, const Vector& weights, const Vector& right,
                     RowMatrix& square, Vector& product);

// -2 sum log T_ii: the log-determinant of the matrix that T is the inverse factor of.
double log_determinant(const RowMatrix& factor);

// T, lower triangular, with T^T T a positive semidefinite matrix; what is negative is ignored.
RowMatrix lower_root(const RowMatrix& matrix);

// The inverse of a lower triangular matrix without zeros on its diagonal.
RowMatrix lower_inverse(const RowMatrix& lower);

// R, upper triangular (columns x columns), with R^T R = A^T A, by orthogonal maps alone: squaring A
// would lose half of the digits. A has as many rows as columns at least.
RowMatrix triangular_factor(const RowMatrix& matrix);

// The singular values, descending, and the right singular vectors as columns, one for each column
// of the matrix: those of the last belong to what its rows do not show.
struct RightSingular {
  Vector values;
  RowMatrix vectors;
};
RightSingular right_singular(const RowMatrix& matrix);
Vector singular_values(const RowMatrix& matrix);

// What the columns of A span, by QR with column pivoting: Q has orthonormal columns, one for each
// pivot above `least_pivot` (by default rounding, of the largest), and A coordinates = Q.
struct ColumnSpace {
  RowMatrix basis;        // Q, rows x rank
  RowMatrix coordinates;  // columns x rank
  Index rank() const { return basis.cols(); }
};
ColumnSpace column_space(const RowMatrix& matrix, double least_pivot = 0);

// The pseudo-inverse of A and what its columns do not span, by QR with column pivoting: pivots
// above `threshold` times the largest count.
struct PseudoInverse {
  RowMatrix matrix;     // columns x rows
  RowMatrix left_null;  // rows x (rows - rank), orthonormal columns
};
PseudoInverse pseudo_inverse(const RowMatrix& matrix, double threshold);

// The orthogonal Q of A P = Q R, by QR with column pivoting, kept as reflections, one a column: of
// many rows and few columns they cost no square of the rows. Pivots above `threshold` times the
// largest count: of Q' A the rows behind as many are zero.
class Reflections {
 public:
  Reflections() = default;
  Reflections(const RowMatrix& matrix, double threshold);

  Index rank() const { return rank_; }
  void apply(RowMatrix& matrix) const;            // Q times it
  void apply_transpose(RowMatrix& matrix) const;  // Q' times it

 private:
  void reflect(Index k, RowMatrix& matrix) const;

  Eigen::MatrixXd vectors_;  // below the diagonal, of ones
  Vector factors_;
  Index rank_ = 0;
};

// The shortest x of those with the least |A x - b|, ranks as above.
Vector least_squares(const RowMatrix& matrix, const Vector& right, double threshold);

// What a positive semidefinite matrix, of which the lower triangle is read, takes to zero: columns
// that span it, by Cholesky with pivots. Of a diagonal of ones the pivots are above `least` or
// rounding; nothing where one is neither, and the square of something has to be asked itself.
std::optional<RowMatrix> clear_null_space(const RowMatrix& matrix, double least);

// 1 / length of each column, 1 for a column of zeros: makes parameters of all units comparable.
Vector inverse_column_lengths(const RowMatrix& matrix);

// The pseudo-inverse of a symmetric positive semidefinite matrix, and its rank to rounding.
struct SymmetricInverse {
  RowMatrix matrix;
  Index rank;
};
SymmetricInverse symmetric_inverse(const RowMatrix& matrix);

// Of a square matrix, by Gaussian elimination.
// A B, and X of L X = B with the lower triangle of L. Written as expressions, every kind of product
// takes the compiler up to a second in each unit.
RowMatrix product(ConstRows left, ConstRows right);
RowMatrix lower_solution(const RowMatrix& lower, ConstRows right);

double determinant(const RowMatrix& matrix);
RowMatrix inverse(const RowMatrix& matrix);
Vector solution(const RowMatrix& matrix, const Vector& right);  // x of A x = b

}  // namespace symkin
