// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/information.hpp"
#include "symkin/design/kernels.hpp"

namespace symkin {

// The weight to move from the candidate with rows `giver` to that with rows `taker` (rows x p) so
// that log det(M + a (taker^T taker - giver^T giver)) is largest over 0 <= a <= limit.
class PairStep {
 public:
  explicit PairStep(Shape shape);

  double operator()(const Information& information, const double* giver, const double* taker,
                    double limit);

 private:
  double single(const Information& information, const double* giver, const double* taker,
                double limit);

  Shape shape_;
  RowMatrix pair_, solved_, gram_, product_;
};

}  // namespace symkin
