// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/selection/selection.hpp"

namespace symkin {

// The criterion's value for an information matrix (p x p): O1 to O5 from the roots of its
// eigenvalues, the singular values of the rows. NaN if the matrix is singular.
double criterion_value(const RowMatrix& information, const SelectionOptions& options);

// The logarithm of the value, negated for expected_error: larger is better for every criterion.
// -infinity if the matrix is singular.
double criterion_merit(const RowMatrix& information, const SelectionOptions& options);

// G with d merit = trace(G dM) to first order. O2, O3 and O4 hang on the smallest eigenvalue alone
// and have a kink where two are equal; its neighbours take part here, so that the direction helps
// there too.
RowMatrix criterion_gradient(const RowMatrix& information, const SelectionOptions& options);

}  // namespace symkin
