// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/aligned_array.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

constexpr Index kBlock = 256;  // candidates in a block
constexpr Index kGroup = 32;   // candidates that a kernel handles, or skips, at once
constexpr Index kGroups = kBlock / kGroup;

// Candidates in blocks of columns: the 256 values of one column lie together, then those of the
// next. Eight lanes of a column make one wide load. Lanes beyond the last candidate are zero.
class ColumnBlocks {
 public:
  ColumnBlocks() = default;
  ColumnBlocks(Index count, Index columns)
      : count_(count),
        columns_(columns),
        blocks_((count + kBlock - 1) / kBlock),
        data_(blocks_ * columns * kBlock) {}

  Index count() const { return count_; }
  Index columns() const { return columns_; }
  Index blocks() const { return blocks_; }

  double* block(Index b) { return data_.data() + b * columns_ * kBlock; }
  const double* block(Index b) const { return data_.data() + b * columns_ * kBlock; }

  void set(Index candidate, const double* values) {
    double* lane = block(candidate / kBlock) + candidate % kBlock;
    for (Index c = 0; c < columns_; ++c) {
      lane[c * kBlock] = values[c];
    }
  }

  void get(Index candidate, double* values) const {
    const double* lane = block(candidate / kBlock) + candidate % kBlock;
    for (Index c = 0; c < columns_; ++c) {
      values[c] = lane[c * kBlock];
    }
  }

  // A candidate of zeros brings no information and so is never chosen.
  void clear(Index candidate) {
    double* lane = block(candidate / kBlock) + candidate % kBlock;
    for (Index c = 0; c < columns_; ++c) {
      lane[c * kBlock] = 0;
    }
  }

 private:
  Index count_ = 0, columns_ = 0, blocks_ = 0;
  AlignedArray data_;
};

}  // namespace symkin
