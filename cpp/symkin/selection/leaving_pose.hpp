// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/selection/information.hpp"
#include "symkin/selection/kernels.hpp"

namespace symkin {

// A chosen pose that might be exchanged, prepared for the pair kernel: C_i M^-1, D_ii and
// (I - D_ii)^-1 by the inverse of M.
class LeavingPose {
 public:
  // rows: C_i, shape.rows x shape.parameters.
  LeavingPose(const Information& information, const double* rows, Shape shape);

  const Leaving& view() const { return view_; }
  double trace() const { return view_.trace; }

  // The ratio of the determinants after and before the exchange for one candidate's rows.
  double ratio(const Information& information, const double* rows, Shape shape) const;

 private:
  RowMatrix y_, s_;
  Leaving view_{};
};

}  // namespace symkin
