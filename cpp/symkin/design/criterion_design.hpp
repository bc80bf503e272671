// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"

namespace symkin {

// An approximate design for O2 to O5 or expected_error, and what it proves.
struct CriterionDesign {
  double bound;  // no selection without repeats has a larger value, or a smaller expected error
  std::vector<Index> candidates;  // of some weight, the largest weight first
};

// From the weights of the chosen candidates. Every bound compares the criterion with q = trace(T
// M_S T^T) for a fixed T, and q with that of the N candidates that make it largest. With the
// parameters in their unit, T likewise, and s_1 >= ... the roots of the eigenvalues of M_S:
//   O3^2 = s_p^2 <= q / |T|^2 (Frobenius norm)
//   O5^2 = (sum 1/s_i)^-2 <= q / (sum t_i^(2/3))^3, t_i the singular values of T (Hoelder)
//   trace(M_S^-1 B) >= (sum u_i)^2 / q, u_i the singular values of T B^(1/2) (Cauchy and Schwarz)
// and s_1^2 >= q / |T|^2 for the largest one, in the ratios O2 and O4. They are tight where T is
// the gradient of the criterion at the best weights.
CriterionDesign criterion_design(const SelectionProblem& problem, const std::vector<Index>& chosen);

}  // namespace symkin
