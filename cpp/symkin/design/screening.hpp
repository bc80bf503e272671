// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "symkin/design/candidate_blocks.hpp"

namespace symkin {

struct RankedCandidate {
  Index index;
  double value;
};

// The `keep` candidates of largest value; of equal ones those of lower index.
class TopCandidates {
 public:
  explicit TopCandidates(Index keep, double floor = 0);

  double threshold() const { return threshold_; }
  void offer(Index index, double value) {
    if (value > threshold_) {
      kept_.push_back({index, value});
      if (kept_.size() >= capacity_) {
        prune();
      }
    }
  }
  // A block of candidates with the largest value of each group; most groups hold none to keep.
  void offer_block(Index first, const std::array<double, kBlock>& values,
                   const std::array<double, kGroups>& group_max);
  void merge(const TopCandidates& other);
  std::vector<RankedCandidate> sorted();  // largest first

 private:
  void prune();

  std::size_t keep_, capacity_;
  double threshold_;
  std::vector<RankedCandidate> kept_;
};

// The sum of the `count` largest values of a sorted list.
double largest_sum(const std::vector<RankedCandidate>& sorted, Index count);

// The variance function d_j = trace(C_j T^T T C_j^T) of all candidates, less `share` times that of
// `loss` if it is given, and the `keep` largest of those above `floor`. Candidates without any d_j,
// as those excluded, are never kept.
struct Screen {
  RowMatrix transform;  // T, lower triangular, for the candidates' own rows
  Index keep;
  double floor = 0;
  RowMatrix loss = {};
  double share = 0;
};

// All screens in one pass, or over every stride-th block of candidates only.
std::vector<std::vector<RankedCandidate>> screen_candidates(const CandidateBlocks& candidates,
                                                            const std::vector<Screen>& screens,
                                                            Index stride = 1);

}  // namespace symkin
