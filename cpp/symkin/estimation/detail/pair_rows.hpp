// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/latent_poses.hpp"

namespace symkin {

// Poses between which something was measured, directly or by way of others: they are eliminated
// together.
class PoseBlocks {
 public:
  PoseBlocks() = default;
  // Of poses that are set aside nothing is between them and others.
  PoseBlocks(const Observations& observations, const std::vector<bool>& aside);

  // Of the block that a pose is in the first, which stands for it; itself, of a pose alone.
  Index first(Index pose) const { return blocks_.empty() ? pose : first_[at(pose)]; }
  bool alone(Index pose) const { return blocks_.empty() || blocks_[at(first(pose))].size() < 2; }
  const std::vector<Index>& of(Index first) const { return blocks_[at(first)]; }
  // Places in a block of poses that are in so many pairs that the others are eliminated first.
  std::vector<Index> hubs(Index first) const;

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  std::vector<Index> first_;
  std::vector<Index> pairs_;                // of each pose
  std::vector<std::vector<Index>> blocks_;  // of each that is a first, in order; empty: no pairs
};

// The rows of all poses of a block and those between them, linearised: of the tangents of the poses
// one behind the other.
LinearPose block_rows(const Mechanism& mechanism, const Observations& observations,
                      const Layout& layout, const Setup& setup, const RowMatrix& poses,
                      const LatentPoses& rows, const std::vector<Index>& block);

}  // namespace symkin
