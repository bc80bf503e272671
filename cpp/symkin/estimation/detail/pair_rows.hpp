// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include "symkin/estimation/detail/linear_block.hpp"

namespace symkin {

// Poses between which something was measured, directly or by way of others: they are eliminated
// together.
class PoseBlocks {
 public:
  // A pose and which of those that it names.
  using Pair = std::pair<Index, Index>;
  // Poses in order, and what was measured between them, and between them and the hubs.
  struct Piece {
    std::vector<Index> poses;
    std::vector<Pair> pairs;
  };
  struct Block {
    // Poses of so many pairs that the others are eliminated first, and what is left of the block
    // without these. A block that they do not part has no hubs, and is one piece.
    Piece hubs;
    std::vector<Piece> pieces;
  };

  PoseBlocks() = default;
  // Of poses that are set aside nothing is between them and others.
  PoseBlocks(const Observations& observations, const std::vector<bool>& aside);

  // Of the block that a pose is in the first, which stands for it; itself, of a pose alone.
  Index first(Index pose) const { return first_.empty() ? pose : first_[at(pose)]; }
  bool alone(Index pose) const { return block_.empty() || block_[at(first(pose))] < 0; }
  const Block& of(Index first) const { return blocks_[at(block_[at(first)])]; }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  std::vector<Index> first_;
  std::vector<Index> block_;  // of each that is a first, its place below; -1 of a pose alone
  std::vector<Block> blocks_;
};

// The rows of all poses of a block and those between them, linearised and eliminated.
LinearBlock block_rows(const Mechanism& mechanism, const Observations& observations,
                       const Layout& layout, const Setup& setup, const RowMatrix& poses,
                       const LatentPoses& rows, const PoseBlocks::Block& block);

}  // namespace symkin
