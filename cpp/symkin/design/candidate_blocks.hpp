// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include "symkin/design/candidate_rows.hpp"
#include "symkin/design/column_blocks.hpp"
#include "symkin/design/kernels.hpp"

namespace symkin {

// All candidates as blocks of columns, for passes over the whole set. Rows that a source makes are
// kept up to the memory limit, and those that are in memory if they are few; others are made or
// read again in each pass.
class CandidateBlocks {
 public:
  // Excluded candidates (n flags, or none) read as zeros.
  CandidateBlocks(const RowSource& source, std::vector<bool> excluded, int threads,
                  Index memory_limit_bytes);

  Index size() const { return source_.size(); }
  Index available() const { return available_; }  // not excluded
  bool excluded(Index candidate) const {
    return !excluded_.empty() && excluded_[static_cast<std::size_t>(candidate)];
  }
  Shape shape() const { return {source_.rows_per_pose(), source_.parameters()}; }
  Index blocks() const { return (size() + kBlock - 1) / kBlock; }
  int threads() const { return threads_; }

  // The rows of one candidate, excluded or not: rows_per_pose x parameters.
  RowMatrix rows(Index candidate) const;

  // The rows of some candidates, none excluded, in their order.
  void gather(const std::vector<Index>& indices, ColumnBlocks& result) const;

  // The same division into chunks of blocks on any number of threads: task(chunk, reader), where
  // reader yields the blocks of the chunk one by one.
  class Reader;
  Index chunks() const;
  // With a stride above one only every stride-th block of a chunk is read.
  void for_each_chunk(const std::function<void(Index, Reader&)>& task, Index stride = 1) const;

  // Lower triangle of the sum of x^T x over all candidates. Throws InvalidInput that names the
  // first one with a row that is not finite.
  RowMatrix information() const;

 private:
  friend class Reader;
  Index first_block(Index chunk) const { return blocks() * chunk / chunks(); }
  void load(Index block, double* rows, double* columns) const;
  [[noreturn]] void refuse_infinite() const;

  const RowSource& source_;
  std::vector<bool> excluded_;
  Index available_;
  int threads_;
  ColumnBlocks kept_;
};

class CandidateBlocks::Reader {
 public:
  Reader(const CandidateBlocks& candidates, Index first, Index last, Index stride);

  // The next block, or null after the last.
  const double* next();
  Index first_candidate() const { return (next_ - stride_) * kBlock; }  // of the block just read

 private:
  const CandidateBlocks& candidates_;
  Index next_, last_, stride_;
  std::vector<double> rows_;
  AlignedArray columns_;
};

}  // namespace symkin
