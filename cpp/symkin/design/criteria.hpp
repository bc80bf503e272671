// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/selection.hpp"

namespace symkin {

// The criterion's value for an information matrix (p x p): O1 to O5 from the roots of its
// eigenvalues, the singular values of the rows. NaN if the matrix is singular.
double criterion_value(const RowMatrix& information, const SelectionOptions& options);

// The logarithm of the value, negated for expected_error: larger is better for every criterion.
// -infinity if the matrix is singular.
double criterion_merit(const RowMatrix& information, const SelectionOptions& options);

// d merit = trace((gain - loss) dM) to first order. What O2 and O4 lose with the largest eigenvalue
// is the loss; the other criteria have none.
struct CriterionGradient {
  RowMatrix gain;
  RowMatrix loss;  // or empty

  RowMatrix total() const { return loss.size() == 0 ? gain : RowMatrix(gain - loss); }
};

// O2, O3 and O4 hang on the smallest eigenvalue alone, O2 and O4 on the largest too, and have a
// kink where two are equal; the neighbours take part here, the less the sharper, so that the
// direction helps there too.
CriterionGradient criterion_gradient(const RowMatrix& information, const SelectionOptions& options,
                                     double sharpness = 4);

}  // namespace symkin
