// SPDX-License-Identifier: MIT
#include "symkin/design/screening.hpp"

#include <algorithm>
#include <limits>

namespace symkin {
namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();

bool ranks_before(const RankedCandidate& a, const RankedCandidate& b) {
  return a.value > b.value || (a.value == b.value && a.index < b.index);
}

}  // namespace

TopCandidates::TopCandidates(Index keep, double floor)
    : keep_(static_cast<std::size_t>(keep)), capacity_(2 * keep_ + 64), threshold_(floor) {}

void TopCandidates::prune() {
  if (kept_.size() <= keep_) {
    return;
  }
  const auto last = kept_.begin() + static_cast<std::ptrdiff_t>(keep_);
  std::nth_element(kept_.begin(), last, kept_.end(), ranks_before);
  // Later candidates have higher indices: an equal value cannot displace what is kept.
  threshold_ = std::max(threshold_, last->value);
  kept_.erase(last, kept_.end());
}

void TopCandidates::offer_block(Index first, const std::array<double, kBlock>& values,
                                const std::array<double, kGroups>& group_max) {
  for (std::size_t group = 0; group < group_max.size(); ++group) {
    if (group_max[group] > threshold_) {
      const std::size_t begin = group * kGroup;
      for (std::size_t lane = begin; lane < begin + kGroup; ++lane) {
        offer(first + static_cast<Index>(lane), values[lane]);
      }
    }
  }
}

void TopCandidates::merge(const TopCandidates& other) {
  kept_.insert(kept_.end(), other.kept_.begin(), other.kept_.end());
}

std::vector<RankedCandidate> TopCandidates::sorted() {
  prune();
  std::sort(kept_.begin(), kept_.end(), ranks_before);
  return kept_;
}

double largest_sum(const std::vector<RankedCandidate>& sorted, Index count) {
  double sum = 0;
  for (Index i = 0; i < std::min(count, static_cast<Index>(sorted.size())); ++i) {
    sum += sorted[static_cast<std::size_t>(i)].value;
  }
  return sum;
}

std::vector<std::vector<RankedCandidate>> screen_candidates(const CandidateBlocks& candidates,
                                                            const std::vector<Screen>& screens,
                                                            Index stride) {
  std::vector<TopCandidates> none;
  none.reserve(screens.size());
  for (const Screen& screen : screens) {
    none.emplace_back(screen.keep, screen.floor);
  }
  std::vector<std::vector<TopCandidates>> tops(static_cast<std::size_t>(candidates.chunks()), none);
  const auto screen = [&](Index chunk, CandidateBlocks::Reader& reader) {
    alignas(64) std::array<double, kBlock> trace;
    alignas(64) std::array<double, kBlock> loss;
    std::array<double, kGroups> group_max;
    std::array<double, kGroups> unused;
    while (const double* columns = reader.next()) {
      for (std::size_t s = 0; s < screens.size(); ++s) {
        kernels().variance(columns, screens[s].transform.data(), candidates.shape(), trace.data(),
                           group_max.data());
        if (screens[s].loss.size() != 0) {
          // The largest traces of the groups remain above what is left of them.
          kernels().variance(columns, screens[s].loss.data(), candidates.shape(), loss.data(),
                             unused.data());
          for (std::size_t lane = 0; lane < kBlock; ++lane) {
            trace[lane] = trace[lane] > 0 ? trace[lane] - screens[s].share * loss[lane] : kNever;
          }
        }
        tops[static_cast<std::size_t>(chunk)][s].offer_block(reader.first_candidate(), trace,
                                                             group_max);
      }
    }
  };
  candidates.for_each_chunk(screen, stride);
  std::vector<std::vector<RankedCandidate>> result;
  for (std::size_t s = 0; s < screens.size(); ++s) {
    TopCandidates all(screens[s].keep, screens[s].floor);
    for (const auto& chunk : tops) {
      all.merge(chunk[s]);
    }
    result.push_back(all.sorted());
  }
  return result;
}

}  // namespace symkin
