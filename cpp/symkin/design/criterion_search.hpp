// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/problem.hpp"
#include "symkin/support/random.hpp"

namespace symkin {

// Best-pair exchange of any criterion inside a pool, in the parameters' own units. Slower than the
// search of the determinant: it knows no bound that skips candidates.
class CriterionSearch {
 public:
  CriterionSearch(const SelectionProblem& problem, std::vector<Index> pool,
                  const std::vector<Index>& chosen);

  // Exchanges until none in the pool is better. Not thorough: none of the most promising.
  void descend(bool thorough);

  // From a state, swaps `count` chosen poses for others at random.
  void kick(const std::vector<Index>& state, Index count, Random& random);

  double merit() const { return merit_; }
  std::vector<Index> chosen() const;  // candidates, ascending
  const std::vector<Index>& state() const { return chosen_; }
  void restore(const std::vector<Index>& state);
  Index exchanges() const { return exchanges_; }

 private:
  struct Pair {
    std::size_t place;
    Index member;
    double gain;  // of the merit, to first order
  };

  RowMatrix rows(Index member) const;
  bool allowed(std::size_t place, Index member) const;
  RowMatrix without(std::size_t place) const;
  void rebuild();
  bool improve_error();
  bool improve_eigenvalues(bool thorough);
  void exchange(std::size_t place, Index member);

  const SelectionProblem& problem_;
  Shape shape_;
  std::vector<Index> pool_, chosen_;
  ColumnBlocks x_;
  RowMatrix information_;
  double merit_ = 0;
  Index exchanges_ = 0;
};

}  // namespace symkin
