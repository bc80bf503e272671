// SPDX-License-Identifier: MIT
#include "symkin/design/candidate_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "symkin/support/error.hpp"
#include "symkin/support/parallel.hpp"

namespace symkin {
namespace {

constexpr Index kKeptValues = 4'000'000;  // of rows that are in memory anyway: 32 MB of columns
// Less is done before a thread has started.
constexpr Index kValuesPerThread = 500'000;
constexpr Index kMadePerThread = 50'000;
constexpr Index kChunks = 64;
constexpr Index kLine = 8;             // doubles
constexpr Index kBlocksPerChunk = 16;  // at least

}  // namespace

CandidateBlocks::CandidateBlocks(const RowSource& source, std::vector<bool> excluded, int threads,
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
  kept_ = ColumnBlocks(source.size(), shape().width());
  parallel_for(chunks(), threads_, [&](Index chunk) {
    std::vector<double> rows(static_cast<std::size_t>(shape().width() * kBlock));
    for (Index b = first_block(chunk); b < first_block(chunk + 1); ++b) {
      load(b, rows.data(), kept_.block(b));
    }
  });
}

Index CandidateBlocks::chunks() const {
  return std::clamp<Index>(blocks() / kBlocksPerChunk, 1, kChunks);
}

void CandidateBlocks::for_each_chunk(const std::function<void(Index, Reader&)>& task,
                                     Index stride) const {
  parallel_for(chunks(), threads_, [&](Index chunk) {
    Reader reader(*this, first_block(chunk), first_block(chunk + 1), stride);
    task(chunk, reader);
  });
}

RowMatrix CandidateBlocks::rows(Index candidate) const {
  RowMatrix result(shape().rows, shape().parameters);
  source_.fill(candidate, 1, result.data());
  return result;
}

void CandidateBlocks::gather(const std::vector<Index>& indices, ColumnBlocks& result) const {
  const Index width = shape().width();
  std::vector<double> row(static_cast<std::size_t>(width));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const double* values = row.data();
    if (source_.in_memory() != nullptr) {
      values = source_.in_memory() + indices[i] * width;
    } else if (kept_.count() != 0) {
      kept_.get(indices[i], row.data());
    } else {
      source_.fill(indices[i], 1, row.data());
    }
    result.set(static_cast<Index>(i), values);
  }
}

RowMatrix CandidateBlocks::information() const {
  const Index p = shape().parameters;
  std::vector<RowMatrix> sums(static_cast<std::size_t>(chunks()), RowMatrix::Zero(p, p));
  for_each_chunk([&](Index chunk, Reader& reader) {
    while (const double* columns = reader.next()) {
      kernels().outer_sum(columns, shape(), sums[static_cast<std::size_t>(chunk)].data());
    }
  });
  RowMatrix total = RowMatrix::Zero(p, p);
  for (const RowMatrix& sum : sums) {
    total += sum;
  }
  if (!total.allFinite()) {
    refuse_infinite();
  }
  return total;
}

void CandidateBlocks::load(Index block, double* rows, double* columns) const {
  const Index width = shape().width();
  const Index first = block * kBlock;
  const Index count = std::min(kBlock, size() - first);
  const double* values = rows;
  if (source_.in_memory() != nullptr) {
    values = source_.in_memory() + first * width;
  } else {
    source_.fill(first, count, rows);
  }
  for (Index lane = 0; lane < count; lane += kLine) {
    // Whole cache lines of a column: a lane at a time would write all columns in turn.
    const Index lanes = std::min(kLine, count - lane);
    for (Index c = 0; c < width; ++c) {
      for (Index k = 0; k < lanes; ++k) {
        columns[c * kBlock + lane + k] = values[(lane + k) * width + c];
      }
    }
  }
  for (Index lane = 0; lane < kBlock; ++lane) {
    if (lane >= count || excluded(first + lane)) {
      for (Index c = 0; c < width; ++c) {
        columns[c * kBlock + lane] = 0;
      }
    }
  }
}

void CandidateBlocks::refuse_infinite() const {
  for_each_chunk([&](Index, Reader& reader) {
    while (const double* columns = reader.next()) {
      for (Index lane = 0; lane < kBlock; ++lane) {
        for (Index c = 0; c < shape().width(); ++c) {
          if (!std::isfinite(columns[c * kBlock + lane])) {
            throw InvalidInput("candidate " + std::to_string(reader.first_candidate() + lane) +
                               " has a row that is not finite (parameter " +
                               std::to_string(c % shape().parameters) +
                               "); leave out or forbid poses that cannot be reached");
          }
        }
      }
    }
  });
  throw InvalidInput("the candidates' rows are too large: the sum of their squares overflows");
}

CandidateBlocks::Reader::Reader(const CandidateBlocks& candidates, Index first, Index last,
                                Index stride)
    : candidates_(candidates), next_(first), last_(last), stride_(stride) {
  if (candidates.kept_.count() == 0) {
    columns_ = AlignedArray(candidates.shape().width() * kBlock);
    if (candidates.source_.in_memory() == nullptr) {
      rows_.resize(static_cast<std::size_t>(candidates.shape().width() * kBlock));
    }
  }
}

const double* CandidateBlocks::Reader::next() {
  if (next_ >= last_) {
    return nullptr;
  }
  const Index block = next_;
  next_ += stride_;
  if (candidates_.kept_.count() != 0) {
    return candidates_.kept_.block(block);
  }
  candidates_.load(block, rows_.data(), columns_.data());
  return columns_.data();
}

}  // namespace symkin
