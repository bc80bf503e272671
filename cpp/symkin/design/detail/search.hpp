// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/detail/criteria.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/problem.hpp"
#include "symkin/support/random.hpp"

namespace symkin::design::detail {

constexpr double kGain = 1e-10;  // of a ratio or merit that counts as better

// Candidates as points (count x width), like ones near each other. A row and its negative bring the
// same information, so each row is turned to one side first.
RowMatrix candidate_points(const ColumnBlocks& candidates);

// The cluster of each point: centres are taken one after the other where the points are farthest
// from all centres so far (Gonzalez 1985). At most `count` clusters, none empty.
Indices farthest_first_clusters(const RowMatrix& points, Index count);

// Exchange inside a pool of candidates, from those of them that are chosen.
class PoolSearch {
 public:
  PoolSearch(const PoolSearch&) = delete;
  PoolSearch& operator=(const PoolSearch&) = delete;
  virtual ~PoolSearch() = default;

  // Exchanges until none in the pool is better, or until the merit is that of a choice of which
  // this is known.
  virtual void descend(double known = -kInfinity) = 0;
  virtual double merit() const = 0;

  // As often as the options say: from the best choice so far, swaps between `least` and `most` of
  // the chosen poses for others at random, from so many parts of the pool alike, and descends.
  void kick_and_descend(Index parts_wanted, Index least, Index most, Random& random);

  Indices chosen() const;  // candidates, ascending

 protected:
  PoolSearch(const Problem& problem, Indices pool, const Indices& chosen);

  virtual void rebuild() = 0;  // everything that follows from chosen_

  // Whether the member may take the place of a chosen pose.
  bool allowed(Index place, Index member) const;

  const Problem& problem_;
  Indices pool_;
  Indices chosen_;  // members of the pool, as places in it
};

// Exchange of log det M, each time for the best partner (Fedorov, Cook and Nachtsheim).
class DeterminantSearch final : public PoolSearch {
 public:
  // `pool` holds candidates, each once. The ridge is added to the fixed information (whitened).
  DeterminantSearch(const Problem& problem, const Indices& pool, const Indices& chosen,
                    double ridge = 0);

  void descend(double known = -kInfinity) override;
  double merit() const override { return information_.log_det(); }  // whitened

 private:
  struct Pair {
    Index place = -1;  // in chosen_
    BestPair best;     // of the pool's members
  };

  void rebuild() override;
  void exchange(const Pair& pair);
  Pair next_pair();
  void hide_all_but_those_for(Index place);

  Shape shape_;
  RowMatrix fixed_;  // whitened
  ColumnBlocks rows_;
  Products products_;  // hidden for those chosen
  Information information_;
  RowMatrix chosen_rows_;  // (count * rows) x parameters
  Index since_rebuild_ = 0;
};

// The same for any other criterion, in the parameters' own units: the best of the pairs that are
// the most promising to first order. Slower: it knows no bound that skips candidates.
class CriterionSearch final : public PoolSearch {
 public:
  CriterionSearch(const Problem& problem, Indices pool, const Indices& chosen);

  void descend(double known = -kInfinity) override;
  void descend_thoroughly();  // tries all pairs
  double merit() const override { return merit_; }

 private:
  void rebuild() override;
  bool improve(Index tries);
  Vector first_order() const;  // of each member: what it adds to the merit
  double merit_after(Index place, Index member);
  ExchangedRows exchanged(Index member);
  double exact_merit_after(Index place, Index member) const;

  RowMatrix rows_;  // of the pool, one member below the other
  RowMatrix information_;
  double merit_ = 0;
  // As `error_gain` wants rows_, for the expected error alone: few members are ever solved for.
  RowMatrix inverse_, weighted_, solved_;
  std::vector<bool> is_solved_;
};

}  // namespace symkin::design::detail
