// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "symkin/design/design.hpp"
#include "symkin/support/random.hpp"

namespace symkin::testing {

using design::CandidateRows;
using design::Certificate;
using design::Criterion;
using design::RowsInMemory;
using design::RowSource;
using design::select_poses;
using design::Selection;
using design::SelectionMethod;
using design::SelectionOptions;

inline RowMatrix random_rows(Index rows, Index parameters, std::uint64_t seed) {
  Random random(seed);
  RowMatrix result(rows, parameters);
  for (Index i = 0; i < result.size(); ++i) {
    result.data()[i] = random.normal();
  }
  return result;
}

inline RowMatrix information(const RowMatrix& rows, Index rows_per_pose,
                             const std::vector<Index>& chosen) {
  RowMatrix sum = RowMatrix::Zero(rows.cols(), rows.cols());
  for (const Index j : chosen) {
    const RowMatrix c = rows.middleRows(j * rows_per_pose, rows_per_pose);
    sum += c.transpose() * c;
  }
  return sum;
}

inline double log_det(const RowMatrix& matrix) {
  const Eigen::LLT<RowMatrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) {
    return -std::numeric_limits<double>::infinity();
  }
  const RowMatrix lower = cholesky.matrixL();
  return 2 * lower.diagonal().array().log().sum();
}

// Every choice of `count` of n, in order.
inline void for_each_subset(Index n, Index count,
                            const std::function<void(const std::vector<Index>&)>& visit) {
  std::vector<Index> chosen(static_cast<std::size_t>(count));
  const std::function<void(Index, Index)> choose = [&](Index place, Index first) {
    if (place == count) {
      visit(chosen);
      return;
    }
    for (Index j = first; j <= n - (count - place); ++j) {
      chosen[static_cast<std::size_t>(place)] = j;
      choose(place + 1, j + 1);
    }
  };
  choose(0, 0);
}

struct Best {
  double value = -std::numeric_limits<double>::infinity();
  std::vector<Index> chosen;
};

// The choice of largest value(M).
inline Best enumerate(const RowMatrix& rows, Index rows_per_pose, Index count,
                      const std::function<double(const RowMatrix&)>& value,
                      const std::function<bool(const std::vector<Index>&)>& allowed = nullptr) {
  Best best;
  for_each_subset(rows.rows() / rows_per_pose, count, [&](const std::vector<Index>& chosen) {
    if (allowed && !allowed(chosen)) {
      return;
    }
    const double v = value(information(rows, rows_per_pose, chosen));
    if (v > best.value) {
      best = {v, chosen};
    }
  });
  return best;
}

inline SelectionOptions options_for(Index count, SelectionMethod method) {
  SelectionOptions options;
  options.count = count;
  options.method = method;
  return options;
}

}  // namespace symkin::testing
