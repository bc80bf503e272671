// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include "symkin/design/column_blocks.hpp"
#include "symkin/design/information.hpp"
#include "symkin/design/kernels.hpp"
#include "symkin/design/leaving_pose.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/support/random.hpp"

namespace symkin {

// Exchange of log det M inside a pool of candidates, each time for the best partner (Fedorov,
// Cook and Nachtsheim).
class DeterminantSearch {
 public:
  // `pool` holds candidates, each once; the search starts from those of them that are chosen. The
  // ridge is added to the fixed information (whitened).
  DeterminantSearch(const SelectionProblem& problem, std::vector<Index> pool,
                    const std::vector<Index>& chosen, double ridge = 0);

  // Exchanges until no exchange in the pool is better by more than rounding, or until the log det
  // is that of a set of which this is known.
  void descend(double known = -std::numeric_limits<double>::infinity());

  // From a state, swaps `count` chosen poses for others at random, from all parts of the pool
  // alike.
  void kick(const std::vector<Index>& state, Index count, Random& random);

  double log_det() const { return information_.log_det(); }  // whitened
  std::vector<Index> chosen() const;                         // candidates, ascending
  Index exchanges() const { return exchanges_; }

  // A state to come back to: the members of the pool that are chosen.
  const std::vector<Index>& state() const { return chosen_; }
  void restore(const std::vector<Index>& state);

 private:
  struct Pair {
    Index place = -1;   // in chosen_
    Index member = -1;  // of the pool
    double ratio = 1;
  };

  double* gram(Index block) { return gram_.data() + block * shape_.gram_size() * kBlock; }
  const double* gram(Index block) const {
    return gram_.data() + block * shape_.gram_size() * kBlock;
  }

  void sort_pool(const std::vector<Index>& chosen);
  void rebuild();
  void count_conflicts();
  void hide(Index member);
  void show(Index member, const double* rows);
  void set_gram(Index member, const RowMatrix& products);
  void update(const double* rows, double sign);
  void exchange(const Pair& pair);
  Pair next_pair();
  void consider_neighbours(const LeavingPose& leaving, Index place, Pair& best) const;

  const SelectionProblem& problem_;
  Shape shape_;
  RowMatrix fixed_;  // whitened
  std::vector<Index> pool_;
  ColumnBlocks all_;  // every member
  ColumnBlocks x_;    // zeros for those chosen or too near to a chosen one
  AlignedArray gram_, trace_, group_max_;
  Information information_;
  std::vector<Index> chosen_;  // members
  RowMatrix chosen_rows_;      // count x width
  Vector chosen_trace_;        // d_i of each
  LeavingPose leaving_;
  std::vector<Index> conflicts_;  // with chosen poses, for each member; only with spacing
  std::vector<bool> is_chosen_;
  std::vector<Index> hidden_;              // members that are zero in x_
  std::vector<std::vector<Index>> parts_;  // members that are near each other
  Vector untried_;                         // d_i of the chosen ones that have not been tried
  Vector work_;
  Index exchanges_ = 0, since_rebuild_ = 0;
};

}  // namespace symkin
