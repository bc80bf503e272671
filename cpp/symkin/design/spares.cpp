// SPDX-License-Identifier: MIT
#include "symkin/design/spares.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "symkin/design/information.hpp"
#include "symkin/design/screening.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr Index kMoreThanAsked = 256;  // adding a spare lowers the rank of those like it

double gain(const Information& information, const RowMatrix& rows) {
  const RowMatrix products = rows * information.inverse() * rows.transpose();
  return (RowMatrix::Identity(rows.rows(), rows.rows()) + products).determinant();
}

}  // namespace

std::vector<Index> spare_poses(const SelectionProblem& problem, const std::vector<Index>& chosen) {
  std::vector<Index> spares;
  Information information(problem.whitened_information(chosen));
  if (problem.options.spare_count == 0 || !information.positive_definite()) {
    return spares;
  }
  const RowMatrix transform = problem.own_transform(inverse_factor(information.matrix()));
  const Index asked = std::min(problem.options.spare_count, problem.candidates.size());
  const Index keep = static_cast<Index>(chosen.size()) + 4 * asked + kMoreThanAsked;
  const auto top = screen_candidates(problem.candidates, {{transform, keep}}).front();
  std::vector<Index> taken = chosen;
  while (static_cast<Index>(spares.size()) < problem.options.spare_count) {
    check_interrupt();
    double best = 0;
    RankedCandidate next{-1, 0};
    RowMatrix next_rows;
    for (const RankedCandidate& candidate : top) {
      if (std::find(taken.begin(), taken.end(), candidate.index) != taken.end() ||
          !problem.spacing.fits(candidate.index, taken)) {
        continue;
      }
      const RowMatrix rows =
          problem.candidates.rows(candidate.index) * problem.whitening.transform.transpose();
      const double value = gain(information, rows);
      if (value > best) {
        best = value;
        next = candidate;
        next_rows = rows;
      }
    }
    if (next.index < 0) {
      break;
    }
    information.add(next_rows.data(), next_rows.rows(), 1);
    taken.push_back(next.index);
    spares.push_back(next.index);
  }
  return spares;
}

}  // namespace symkin
