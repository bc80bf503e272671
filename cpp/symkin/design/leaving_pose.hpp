// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/information.hpp"
#include "symkin/design/kernels.hpp"

namespace symkin {

// A chosen pose that might be exchanged, prepared for the pair kernel: C_i M^-1, D_ii and
// (I - D_ii)^-1 by the inverse of M.
class LeavingPose {
 public:
  explicit LeavingPose(Shape shape) : shape_(shape), y_(shape.rows, shape.parameters) {}

  // rows: C_i, shape.rows x shape.parameters.
  void prepare(const Information& information, const double* rows);

  Leaving view() const { return {y_.data(), s_.data(), base_, trace_}; }
  double trace() const { return trace_; }

  // The ratio of the determinants after and before the exchange for one candidate's rows.
  double ratio(const Information& information, const double* rows) const;

 private:
  Shape shape_;
  RowMatrix y_, s_;
  double base_ = 0, trace_ = 0;
};

}  // namespace symkin
