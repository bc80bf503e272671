// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include "symkin/design/detail/blocks.hpp"
#include "symkin/design/row_source.hpp"

namespace symkin::design::detail {

// All candidates as blocks of columns, for passes over the whole set. Rows that a source makes are
// kept up to the memory limit, and those that are in memory if they are few; others are made or
// read again in each pass.
class Candidates {
 public:
  // Excluded candidates (n flags, or none) read as zeros: they bring nothing and are never chosen.
  Candidates(const RowSource& source, std::vector<bool> excluded, int threads,
             Index memory_limit_bytes);

  Index size() const { return source_.size(); }
  Index available() const { return available_; }  // not excluded
  bool excluded(Index candidate) const { return !excluded_.empty() && at(excluded_, candidate); }
  Shape shape() const { return {source_.rows_per_pose(), source_.parameters()}; }
  Index blocks() const { return (size() + kBlock - 1) / kBlock; }

  // The rows of one candidate, excluded or not: rows_per_pose x parameters.
  RowMatrix rows(Index candidate) const { return rows(Indices{candidate}); }
  void read(Index candidate, double* rows) const;

  // The rows of some candidates, one below the other.
  RowMatrix rows(const Indices& candidates) const;

  // task(chunk, first candidate, columns) for every stride-th block of each chunk of blocks, one
  // after the other. The division into chunks is the same on any number of threads.
  using Task = std::function<void(Index, Index, const double*)>;
  Index chunks() const;
  void for_each_block(const Task& task, Index stride = 1) const;

  // The sum of x^T x over all candidates. Throws InvalidInput that names the first one with a row
  // that is not finite.
  RowMatrix information() const;

 private:
  Index first_block(Index chunk) const { return blocks() * chunk / chunks(); }
  void load(Index block, std::vector<double>& rows, double* columns) const;
  [[noreturn]] void refuse_infinite() const;

  const RowSource& source_;
  std::vector<bool> excluded_;
  Index available_;
  int threads_;
  ColumnBlocks kept_;
};

struct RankedCandidate {
  Index index;
  double value;
};

Indices indices_of(const std::vector<RankedCandidate>& candidates);

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
std::vector<std::vector<RankedCandidate>> screen_candidates(const Candidates& candidates,
                                                            const std::vector<Screen>& screens,
                                                            Index stride = 1);

}  // namespace symkin::design::detail
