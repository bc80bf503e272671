// SPDX-License-Identifier: MIT
#include "symkin/design/verification.hpp"

#include <algorithm>
#include <limits>

#include "symkin/design/leaving_pose.hpp"
#include "symkin/design/sort_unique.hpp"

namespace symkin {
namespace {

constexpr double kGain = 1e-9;  // above what the search in the pool leaves
constexpr Index kReturned = 256;

// What is needed of M, in coordinates in which it is the identity: z = T x.
class Verifier {
 public:
  Verifier(const SelectionProblem& problem, const std::vector<Index>& chosen)
      : problem_(problem), chosen_(chosen), shape_(problem.candidates.shape()) {
    const RowMatrix factor = inverse_factor(problem.whitened_information(chosen));
    if (factor.size() == 0) {
      return;
    }
    transform_ = problem.own_transform(factor);
    identity_.reset(RowMatrix::Identity(shape_.parameters, shape_.parameters));
    for (const Index candidate : chosen) {
      const RowMatrix z = problem.candidates.rows(candidate) * transform_.transpose();
      leaving_.emplace_back(shape_);
      leaving_.back().prepare(identity_, z.data());
      least_trace_ = std::min(least_trace_, leaving_.back().trace());
    }
  }

  bool possible() const { return !leaving_.empty(); }

  void check(CandidateBlocks::Reader& reader, TopCandidates& better) const {
    AlignedArray columns(shape_.width() * kBlock);
    AlignedArray z(shape_.width() * kBlock);
    AlignedArray gram(shape_.gram_size() * kBlock);
    AlignedArray trace(kBlock);
    AlignedArray group_max(kGroups);
    while (const double* block = reader.next()) {
      const Index first = reader.first_candidate();
      const double* x = without_chosen(block, first, columns.data(), better);
      kernels().gram(x, transform_.data(), shape_, gram.data(), trace.data(), group_max.data());
      if (*std::max_element(group_max.data(), group_max.data() + kGroups) < least_trace_) {
        continue;
      }
      kernels().transform(x, transform_.data(), shape_, z.data());
      for (const LeavingPose& leaving : leaving_) {
        BestPair best{1 + kGain, -1};
        kernels().best_pair(z.data(), gram.data(), trace.data(), group_max.data(), leaving.view(),
                            shape_, best);
        if (best.lane >= 0) {
          better.offer(first + best.lane, best.ratio);
        }
      }
    }
  }

 private:
  // The block with zeros for what may not enter: chosen poses and those too near to one. Of these,
  // one that only the pose it would replace is too near to is tried at once.
  const double* without_chosen(const double* block, Index first, double* copy,
                               TopCandidates& better) const {
    std::vector<Index> out;
    for (const Index candidate : chosen_) {
      if (candidate >= first && candidate < first + kBlock) {
        out.push_back(candidate);
      }
    }
    if (problem_.spacing.active()) {
      find_crowded(first, out, better);
    }
    if (out.empty()) {
      return block;
    }
    std::copy_n(block, shape_.width() * kBlock, copy);
    for (const Index candidate : out) {
      for (Index c = 0; c < shape_.width(); ++c) {
        copy[c * kBlock + candidate - first] = 0;
      }
    }
    return copy;
  }

  void find_crowded(Index first, std::vector<Index>& out, TopCandidates& better) const {
    const Index last = std::min(first + kBlock, problem_.candidates.size());
    for (Index j = first; j < last; ++j) {
      std::vector<std::size_t> near;
      for (std::size_t place = 0; place < chosen_.size(); ++place) {
        if (problem_.spacing.conflict(j, chosen_[place])) {
          near.push_back(place);
        }
      }
      if (near.empty() || problem_.candidates.excluded(j)) {
        continue;
      }
      const bool is_chosen = std::find(chosen_.begin(), chosen_.end(), j) != chosen_.end();
      if (near.size() == 1 && !is_chosen) {
        const RowMatrix z = problem_.candidates.rows(j) * transform_.transpose();
        const double ratio = leaving_[near[0]].ratio(identity_, z.data());
        if (ratio > 1 + kGain) {
          better.offer(j, ratio);
        }
      }
      out.push_back(j);
    }
  }

  const SelectionProblem& problem_;
  const std::vector<Index>& chosen_;
  Shape shape_;
  RowMatrix transform_;
  Information identity_;
  std::vector<LeavingPose> leaving_;
  double least_trace_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<Index> improving_candidates(const SelectionProblem& problem,
                                        const std::vector<Index>& chosen) {
  const Verifier verifier(problem, chosen);
  if (!verifier.possible()) {
    return {};
  }
  std::vector<TopCandidates> found(static_cast<std::size_t>(problem.candidates.chunks()),
                                   TopCandidates(kReturned));
  problem.candidates.for_each_chunk([&](Index chunk, CandidateBlocks::Reader& reader) {
    verifier.check(reader, found[static_cast<std::size_t>(chunk)]);
  });
  TopCandidates all(kReturned);
  for (const TopCandidates& chunk : found) {
    all.merge(chunk);
  }
  std::vector<Index> result;
  for (const RankedCandidate& candidate : all.sorted()) {
    result.push_back(candidate.index);
  }
  sort_unique(result);
  return result;
}

}  // namespace symkin
