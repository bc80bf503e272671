// SPDX-License-Identifier: MIT
#include "symkin/design/problem.hpp"

#include <limits>
#include <string>

#include "symkin/design/information.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"

namespace symkin {
namespace {

std::vector<bool> excluded_candidates(const SelectionOptions& options, const Spacing& spacing,
                                      Index size) {
  std::vector<bool> excluded = options.forbidden;
  if (options.required.empty()) {
    return excluded;
  }
  excluded.resize(static_cast<std::size_t>(size), false);
  for (const Index required : options.required) {
    excluded[static_cast<std::size_t>(required)] = true;
  }
  if (spacing.active()) {
    for (Index j = 0; j < size; ++j) {
      if (!spacing.fits(j, options.required)) {
        excluded[static_cast<std::size_t>(j)] = true;
      }
    }
  }
  return excluded;
}

RowMatrix fixed_information(const SelectionOptions& options, const CandidateBlocks& candidates) {
  const Index p = candidates.shape().parameters;
  RowMatrix fixed = options.prior.size() != 0 ? options.prior : RowMatrix::Zero(p, p);
  for (const Index required : options.required) {
    const RowMatrix rows = candidates.rows(required);
    if (!rows.allFinite()) {
      throw InvalidInput("the required candidate " + std::to_string(required) +
                         " has a row that is not finite");
    }
    fixed += rows.transpose() * rows;
  }
  return fixed;
}

}  // namespace

SelectionProblem::SelectionProblem(const RowSource& source, const SelectionOptions& given)
    : options((given.check(source.size(), source.rows_per_pose(), source.parameters()), given)),
      spacing(given.coordinates, given.minimum_distance),
      candidates(source, excluded_candidates(given, spacing, source.size()), given.threads,
                 given.memory_limit_bytes),
      fixed(fixed_information(given, candidates)),
      whitening(whiten(candidates, fixed)),
      whitened_fixed(whitening.transform * fixed * whitening.transform.transpose()),
      free_count(given.count - static_cast<Index>(given.required.size())) {
  if (given.method != SelectionMethod::all && free_count > candidates.available()) {
    throw InvalidInput(
        std::to_string(given.count) + " poses are to be selected, but only " +
        std::to_string(candidates.available() + static_cast<Index>(given.required.size())) +
        " candidates are neither forbidden nor too near to a required one");
  }
}

ColumnBlocks SelectionProblem::whitened(const std::vector<Index>& indices) const {
  const Shape shape = candidates.shape();
  ColumnBlocks own(static_cast<Index>(indices.size()), shape.width());
  candidates.gather(indices, own);
  ColumnBlocks result(own.count(), own.columns());
  for (Index b = 0; b < own.blocks(); ++b) {
    kernels().transform(own.block(b), whitening.transform.data(), shape, result.block(b));
  }
  return result;
}

RowMatrix SelectionProblem::whitened_information(const std::vector<Index>& chosen) const {
  const ColumnBlocks rows = whitened(chosen);
  RowMatrix sum = RowMatrix::Zero(parameters(), parameters());
  for (Index b = 0; b < rows.blocks(); ++b) {
    kernels().outer_sum(rows.block(b), candidates.shape(), sum.data());
  }
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  return whitened_fixed + sum;
}

RowMatrix SelectionProblem::information(const std::vector<Index>& chosen) const {
  RowMatrix result = fixed;
  for (const Index candidate : chosen) {
    const RowMatrix rows = candidates.rows(candidate);
    result += rows.transpose() * rows;
  }
  return result;
}

double SelectionProblem::log_det(const std::vector<Index>& chosen) const {
  const RowMatrix factor = inverse_factor(whitened_information(chosen));
  return factor.size() == 0 ? -std::numeric_limits<double>::infinity()
                            : log_determinant(factor) + whitening.log_det;
}

}  // namespace symkin
