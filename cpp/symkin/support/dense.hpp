// SPDX-License-Identifier: MIT
#pragma once

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

// T, lower triangular, with T^T T the inverse of a positive definite matrix (the inverse of its
// Cholesky factor); empty if it is not positive definite to rounding.
RowMatrix inverse_factor(const RowMatrix& matrix);

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

// Of a square matrix, by Gaussian elimination.
double determinant(const RowMatrix& matrix);
RowMatrix inverse(const RowMatrix& matrix);

}  // namespace symkin
