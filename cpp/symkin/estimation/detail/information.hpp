// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "symkin/support/dense.hpp"

namespace symkin {

// What n rows of a least-squares problem say of its p parameters, computed with columns of length
// one. Nothing here throws.
class Information {
 public:
  explicit Information(const RowMatrix& rows);

  // Whether the columns are so far from dependent that the normal equations show it.
  bool clear() const { return clear_; }
  Index rank() const;
  // (A'A)^-1; infinite if the columns are dependent.
  RowMatrix inverse() const;
  // Squares of a residual (n) that a change of the parameters explains.
  double explained(const Vector& residual) const;
  // Ratio of the largest and the smallest singular value; infinite if the columns are dependent.
  double condition() const;

 private:
  const ColumnSpace& space() const;  // of what is not clear

  const RowMatrix& rows_;  // which outlive it
  Vector scale_;           // 1 / length of each column
  RowMatrix gram_;         // of the scaled columns
  RowMatrix root_;         // lower triangular, root' root = gram^-1
  bool clear_;
  mutable std::optional<ColumnSpace> space_;
};

}  // namespace symkin
