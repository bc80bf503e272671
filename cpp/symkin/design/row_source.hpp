// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "symkin/support/types.hpp"

namespace symkin::design {

// Candidates whose rows need not be held in memory. A candidate brings `rows_per_pose` rows of
// `parameters` values: one for one leg, one a leg for a whole mechanism, more for an orbit.
class RowSource {
 public:
  RowSource() = default;
  RowSource(const RowSource&) = delete;
  RowSource& operator=(const RowSource&) = delete;
  virtual ~RowSource() = default;

  virtual Index size() const = 0;  // candidates
  virtual Index rows_per_pose() const = 0;
  virtual Index parameters() const = 0;

  // The rows of candidates first .. first + count - 1, one after the other. Called from several
  // threads at once and several times for each candidate; the answer must not change.
  virtual void fill(Index first, Index count, double* rows) const = 0;

  // All rows, if they are in memory anyway.
  virtual const double* in_memory() const { return nullptr; }
};

// Candidates in memory: candidate j has the rows j * rows_per_pose ...; the matrix must outlive it.
struct CandidateRows {
  ConstRows rows;  // (candidates * rows_per_pose) x parameters
  Index rows_per_pose = 1;
};

class RowsInMemory final : public RowSource {
 public:
  // Throws InvalidInput if the rows do not make whole candidates.
  explicit RowsInMemory(const CandidateRows& candidates);
  explicit RowsInMemory(CandidateRows&& candidates) = delete;  // it must outlive this

  Index size() const override { return rows_.rows() / rows_per_pose_; }
  Index rows_per_pose() const override { return rows_per_pose_; }
  Index parameters() const override { return rows_.cols(); }
  const double* in_memory() const override { return rows_.data(); }
  void fill(Index first, Index count, double* rows) const override {
    const Index width = rows_per_pose_ * rows_.cols();
    std::copy_n(rows_.data() + first * width, count * width, rows);
  }

 private:
  const ConstRows& rows_;
  Index rows_per_pose_;
};

}  // namespace symkin::design
