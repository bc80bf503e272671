// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "symkin/design/detail/problem.hpp"

namespace symkin::design::detail {

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

// The expected error, trace(M^-1 B), which falls by trace(M^-1 B M^-1 dM) to first order, and
// nowhere by more. Throws InvalidInput if M is singular.
struct ErrorSlopes {
  RowMatrix inverse;   // M^-1
  RowMatrix weighted;  // M^-1 B M^-1
  double error;

  RowMatrix gradient() const { return weighted / error; }  // of the merit
};
ErrorSlopes error_slopes(const RowMatrix& information, const RowMatrix& error_weight);

// Rows that enter or leave a selection.
struct ExchangedRows {
  Eigen::Ref<const RowMatrix> rows;      // r x p
  Eigen::Ref<const RowMatrix> solved;    // rows M^-1
  Eigen::Ref<const RowMatrix> weighted;  // rows M^-1 B M^-1
};

// What the expected error, trace(M^-1 B), loses where some rows replace others, and nothing where
// that would cost digits. No matrix as large as M is factored anew: with U = (in, out), D = (I,
// -I), G = U M^-1 U^T, H = U M^-1 B M^-1 U^T and K = (D + G)^-1 (Woodbury)
//   trace(M^-1 B) - trace((M + in^T in - out^T out)^-1 B) = trace(K H)
//   det(M + in^T in - out^T out) = (-1)^r det(D + G) det M
std::optional<double> error_gain(const ExchangedRows& in, const ExchangedRows& out);

// An approximate design for O2 to O5 or expected_error, and what it proves.
struct CriterionDesign {
  double bound;  // no selection without repeats has a larger value, or a smaller expected error
  Indices candidates;  // of some weight, the largest weight first
};

// From the weights of the chosen candidates. Every bound compares the criterion with q = trace(T
// M_S T^T) for a fixed T, and q with that of the N candidates that make it largest. With the
// parameters in their unit, T likewise, and s_1 >= ... the roots of the eigenvalues of M_S:
//   O3^2 = s_p^2 <= q / |T|^2 (Frobenius norm)
//   O5^2 = (sum 1/s_i)^-2 <= q / (sum t_i^(2/3))^3, t_i the singular values of T (Hoelder)
//   trace(M_S^-1 B) >= (sum u_i)^2 / q, u_i the singular values of T B^(1/2) (Cauchy and Schwarz)
// and s_1^2 >= q / |T|^2 for the largest one, in the ratios O2 and O4. They are tight where T is
// the gradient of the criterion at the best weights.
CriterionDesign criterion_design(const Problem& problem, const Indices& chosen);

}  // namespace symkin::design::detail
