// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/row_columns.hpp"

namespace symkin::design::detail {

// The variances of all candidates' rows, the diagonals of C_j A C_j^T, for several inverses A at
// once: they wait for the next pass over the candidates, in which each row comes from memory once
// for all of them.
class RowVariances {
 public:
  RowVariances(const RowColumns& candidates, Index inverses);  // the candidates must outlive it

  const RowColumns& candidates() const { return x_; }

  void compute(Index which, RowMatrix factor);  // A = T^T T, T lower triangular
  void update(Index which, InverseChange change);
  void pass();

  // Of those of the last pass: the product of 1 + d over a candidate's rows, which det(I + D_jj)
  // does not exceed (Hadamard), and the largest one of each group of kGroup candidates.
  double bound(Index which, Index candidate) const;
  const std::vector<double>& largest(Index which) const { return at(states_, which).largest; }

 private:
  struct State {
    AlignedArray of_rows;
    std::vector<double> largest;
    RowMatrix factor;                    // or empty
    std::vector<InverseChange> changes;  // after it
  };

  void pass(State& state, Index block) const;

  const RowColumns& x_;
  std::vector<State> states_;
};

}  // namespace symkin::design::detail
