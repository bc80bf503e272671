// SPDX-License-Identifier: MIT
#include "symkin/design/detail/candidates.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "symkin/design/detail/information.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/parallel.hpp"

namespace symkin::design::detail {
namespace {

constexpr Index kKeptValues = 4'000'000;  // of rows that are in memory anyway: 32 MB of columns
// Less is done before a thread has started.
constexpr Index kValuesPerThread = 500'000;
constexpr Index kMadePerThread = 50'000;
constexpr Index kChunks = 64;
constexpr Index kBlocksPerChunk = 16;  // at least

bool ranks_before(const RankedCandidate& a, const RankedCandidate& b) {
  return a.value > b.value || (a.value == b.value && a.index < b.index);
}

// The `keep` candidates of largest value above a floor; of equal ones those of lower index.
class TopCandidates {
 public:
  TopCandidates(Index keep, double floor)
      : keep_(static_cast<std::size_t>(keep)), threshold_(floor) {}

  void offer(Index index, double value) {
    if (value > threshold_) {
      kept_.push_back({index, value});
      if (kept_.size() > 2 * keep_ + 64) {
        prune();
      }
    }
  }

  void merge(const TopCandidates& other) {
    kept_.insert(kept_.end(), other.kept_.begin(), other.kept_.end());
  }

  std::vector<RankedCandidate> sorted() {  // largest first
    prune();
    std::sort(kept_.begin(), kept_.end(), ranks_before);
    return std::move(kept_);
  }

 private:
  // Later candidates have higher indices: an equal value cannot displace what is kept.
  void prune() {
    if (kept_.size() > keep_) {
      const auto last = kept_.begin() + static_cast<std::ptrdiff_t>(keep_);
      std::nth_element(kept_.begin(), last, kept_.end(), ranks_before);
      threshold_ = std::max(threshold_, last->value);
      kept_.erase(last, kept_.end());
    }
  }

  std::size_t keep_;
  double threshold_;
  std::vector<RankedCandidate> kept_;
};

}  // namespace

Candidates::Candidates(const RowSource& source, std::vector<bool> excluded, int threads,
                       Index memory_limit_bytes)
    : source_(source),
      excluded_(std::move(excluded)),
      available_(source.size() - std::count(excluded_.begin(), excluded_.end(), true)) {
  const Index values = source.size() * shape().width();
  const bool made = source.in_memory() == nullptr;
  const Index per_thread = made ? kMadePerThread : kValuesPerThread;
  threads_ = static_cast<int>(std::clamp<Index>(values / per_thread, 1, thread_count(threads)));
  const auto limit = memory_limit_bytes / static_cast<Index>(sizeof(double));
  if (values > (made ? limit : std::min(limit, kKeptValues))) {
    return;
  }
  ColumnBlocks kept(source.size(), shape());
  parallel_for(chunks(), threads_, [&](Index chunk) {
    std::vector<double> rows;
    for (Index b = first_block(chunk); b < first_block(chunk + 1); ++b) {
      load(b, rows, kept.block(b));
    }
  });
  kept_ = std::move(kept);
}

Index Candidates::chunks() const {
  return std::clamp<Index>(blocks() / kBlocksPerChunk, 1, kChunks);
}

void Candidates::for_each_block(const Task& task, Index stride) const {
  parallel_for(chunks(), threads_, [&](Index chunk) {
    const bool kept = kept_.count() != 0;
    AlignedArray columns(kept ? 0 : shape().width() * kBlock);
    std::vector<double> rows;
    for (Index b = first_block(chunk); b < first_block(chunk + 1); b += stride) {
      if (!kept) {
        load(b, rows, columns.data());
      }
      task(chunk, b * kBlock, kept ? kept_.block(b) : columns.data());
    }
  });
}

// Kept rows are read; of an excluded candidate none are kept.
void Candidates::read(Index candidate, double* rows) const {
  if (kept_.count() != 0 && !excluded(candidate)) {
    kept_.get(candidate, rows);
  } else {
    source_.fill(candidate, 1, rows);
  }
}

RowMatrix Candidates::rows(const Indices& candidates) const {
  RowMatrix result(size_of(candidates) * shape().rows, shape().parameters);
  for (Index i = 0; i < size_of(candidates); ++i) {
    read(at(candidates, i), result.row(i * shape().rows).data());
  }
  return result;
}

RowMatrix Candidates::information() const {
  const Index p = shape().parameters;
  std::vector<RowMatrix> sums(static_cast<std::size_t>(chunks()), RowMatrix::Zero(p, p));
  for_each_block([&](Index chunk, Index, const double* columns) {
    for (Index group = 0; group < kGroups; ++group) {
      for (Index row = 0; row < shape().rows; ++row) {
        at(sums, chunk)
            .selfadjointView<Eigen::Lower>()
            .rankUpdate(columns_of(columns + group * shape().width() * kGroup, row, p).transpose());
      }
    }
  });
  RowMatrix total = RowMatrix::Zero(p, p);
  for (const RowMatrix& sum : sums) {
    total += sum.selfadjointView<Eigen::Lower>();
  }
  if (!total.allFinite()) {
    refuse_infinite();
  }
  return total;
}

void Candidates::load(Index block, std::vector<double>& rows, double* columns) const {
  const Index width = shape().width();
  const Index first = block * kBlock;
  const Index count = std::min(kBlock, size() - first);
  const double* values = source_.in_memory();
  if (values != nullptr) {
    values += first * width;
  } else {
    rows.resize(static_cast<std::size_t>(width * kBlock));
    source_.fill(first, count, rows.data());
    values = rows.data();
  }
  for (Index group = 0; group < count; group += kGroup) {
    const Index members = std::min(count - group, kGroup);
    const double* from = values + group * width;
    double* to = columns + group * width;
    for (Index c = 0; c < width; ++c) {
      for (Index lane = 0; lane < members; ++lane) {
        to[c * kGroup + lane] = from[lane * width + c];
      }
    }
  }
  for (Index j = 0; j < kBlock && (count < kBlock || !excluded_.empty()); ++j) {
    for (Index c = 0; c < width && (j >= count || excluded(first + j)); ++c) {
      columns[lane_of(j, width) + c * kGroup] = 0;
    }
  }
}

void Candidates::refuse_infinite() const {
  for (Index j = 0; j < size(); ++j) {
    Index row = 0;
    Index parameter = 0;
    if (!excluded(j) && !rows(j).array().isFinite().cast<int>().minCoeff(&row, &parameter)) {
      throw InvalidInput("candidate " + std::to_string(j) +
                         " has a row that is not finite (parameter " + std::to_string(parameter) +
                         "); leave out or forbid poses that cannot be reached");
    }
  }
  throw InvalidInput("the candidates' rows are too large: the sum of their squares overflows");
}

Indices indices_of(const std::vector<RankedCandidate>& candidates) {
  Indices result;
  result.reserve(candidates.size());
  for (const RankedCandidate& candidate : candidates) {
    result.push_back(candidate.index);
  }
  return result;
}

double largest_sum(const std::vector<RankedCandidate>& sorted, Index count) {
  double sum = 0;
  for (Index i = 0; i < std::min(count, size_of(sorted)); ++i) {
    sum += at(sorted, i).value;
  }
  return sum;
}

std::vector<std::vector<RankedCandidate>> screen_candidates(const Candidates& candidates,
                                                            const std::vector<Screen>& screens,
                                                            Index stride) {
  std::vector<TopCandidates> none;
  none.reserve(screens.size());
  for (const Screen& screen : screens) {
    none.emplace_back(screen.keep, screen.floor);
  }
  const Shape shape = candidates.shape();
  std::vector<std::vector<TopCandidates>> tops(static_cast<std::size_t>(candidates.chunks()), none);
  candidates.for_each_block(
      [&](Index chunk, Index first, const double* columns) {
        for (std::size_t s = 0; s < screens.size(); ++s) {
          const Screen& screen = screens[s];
          double traces[kBlock];
          double losses[kBlock] = {};
          compute_products(columns, shape, screen.transform, traces);
          if (screen.loss.size() != 0) {
            compute_products(columns, shape, screen.loss, losses);
          }
          for (Index lane = 0; lane < kBlock; ++lane) {
            if (traces[lane] > 0) {
              at(tops, chunk)[s].offer(first + lane, traces[lane] - screen.share * losses[lane]);
            }
          }
        }
      },
      stride);
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

}  // namespace symkin::design::detail
