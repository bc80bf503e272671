// SPDX-License-Identifier: MIT
#include "symkin/design/detail/problem.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kRankTolerance = 1e-10;  // of the largest singular value
constexpr double kRounding = 1e-14;       // of the longest column: no unit makes one so short
// Squaring the rows into an information matrix keeps this ratio of singular values to six digits.
constexpr double kSafeEigenvalueRatio = 1e-10;

std::vector<bool> excluded_candidates(const SelectionOptions& options, const Spacing& spacing,
                                      Index size) {
  std::vector<bool> excluded = options.forbidden;
  if (options.required.empty()) {
    return excluded;
  }
  excluded.resize(static_cast<std::size_t>(size), false);
  for (Index j = 0; spacing.active() && j < size; ++j) {
    at(excluded, j) = at(excluded, j) || !spacing.fits(j, options.required);
  }
  for (const Index required : options.required) {
    at(excluded, required) = true;
  }
  return excluded;
}

RowMatrix fixed_information(const SelectionOptions& options, const Candidates& candidates) {
  const Index p = candidates.shape().parameters;
  RowMatrix fixed = options.prior.size() != 0 ? options.prior : RowMatrix::Zero(p, p);
  for (const Index required : options.required) {
    const RowMatrix rows = candidates.rows(required);
    if (!rows.allFinite()) {
      throw InvalidInput("the required candidate " + std::to_string(required) +
                         " has a row that is not finite");
    }
    fixed += product(rows.transpose(), rows);
  }
  return fixed;
}

// An R (p x p) with R^T R the whole information, by orthogonal maps alone: no squaring.
RowMatrix orthogonal_factor(const Candidates& candidates, const RowMatrix& fixed) {
  const Shape shape = candidates.shape();
  RowMatrix r = lower_root(fixed);
  Indices block;
  for (Index j = 0; j < candidates.size(); ++j) {
    if (!candidates.excluded(j)) {
      block.push_back(j);
    }
    if (size_of(block) == kBlock || j + 1 == candidates.size()) {
      check_interrupt();
      RowMatrix stack(shape.parameters + size_of(block) * shape.rows, shape.parameters);
      stack << r, candidates.rows(block);
      r = triangular_factor(stack);
      block.clear();
    }
  }
  return r;
}

// T from R, for candidates that are nearly or wholly rank deficient.
RowMatrix careful_transform(const Candidates& candidates, const RowMatrix& fixed) {
  const RowMatrix r = orthogonal_factor(candidates, fixed);
  const Index p = r.cols();
  RowMatrix scaled = r;
  Vector lengths = r.colwise().norm();
  const double nothing = kRounding * lengths.maxCoeff();
  for (Index c = 0; c < p; ++c) {
    if (lengths[c] <= nothing) {
      scaled.col(c).setZero();
      lengths[c] = 1;
    }
  }
  scaled *= lengths.cwiseInverse().asDiagonal();
  const RightSingular svd = right_singular(scaled);
  const Vector& s = svd.values;
  const Index rank = s[0] > 0 ? (s.array() > kRankTolerance * s[0]).count() : 0;
  if (rank < p) {
    throw NotIdentifiable(
        "the candidates show only " + counted(rank, "independent combination") + " of the " +
            std::to_string(p) + " parameters; no choice of poses can identify the others",
        named_directions(svd.vectors.rightCols(p - rank), lengths.cwiseInverse()));
  }
  // R^T is the Cholesky factor up to the signs of its columns.
  RowMatrix transform = lower_inverse(r.transpose());
  for (Index a = 0; a < p; ++a) {
    transform.row(a) *= transform(a, a) < 0 ? -1.0 : 1.0;
  }
  return transform;
}

// `fixed` (p x p) is the information that every selection has: measured and required poses. Throws
// NotIdentifiable with the directions that neither it nor the candidates show (singular values
// below 1e-10 of the largest, columns scaled to length one).
Whitening whiten(const Candidates& candidates, const RowMatrix& fixed) {
  const RowMatrix total = candidates.information() + fixed;
  Vector lengths = total.diagonal().cwiseSqrt();
  lengths = (lengths.array() > 0).select(lengths, 1);
  const Vector inverse_lengths = lengths.cwiseInverse();
  const RowMatrix scaled = inverse_lengths.asDiagonal() * total * inverse_lengths.asDiagonal();
  const Vector eigenvalues = symmetric_eigenvalues(scaled);

  Whitening result;
  if (eigenvalues[0] > kSafeEigenvalueRatio * eigenvalues[total.rows() - 1]) {
    result.transform = inverse_factor(scaled) * inverse_lengths.asDiagonal();
  } else {
    result.transform = careful_transform(candidates, fixed);
  }
  result.transform *= std::sqrt(static_cast<double>(std::max<Index>(1, candidates.available())));
  result.log_det = log_determinant(result.transform);
  return result;
}

}  // namespace

Problem::Problem(const RowSource& source, const SelectionOptions& given)
    : options((given.check(source.size(), source.rows_per_pose(), source.parameters()), given)),
      spacing(given.coordinates, given.minimum_distance),
      candidates(source, excluded_candidates(given, spacing, source.size()), given.threads,
                 given.memory_limit_bytes),
      fixed(fixed_information(given, candidates)),
      whitening(whiten(candidates, fixed)),
      whitened_fixed(product(product(whitening.transform, fixed), whitening.transform.transpose())),
      free_count(given.count - size_of(given.required)) {
  if (given.method != SelectionMethod::all && free_count > candidates.available()) {
    throw InvalidInput(std::to_string(given.count) + " poses are to be selected, but only " +
                       std::to_string(candidates.available() + size_of(given.required)) +
                       " candidates are neither forbidden nor too near to a required one");
  }
}

RowMatrix Problem::whitened_rows(const Indices& chosen) const {
  return product(candidates.rows(chosen), whitening.transform.transpose());
}

RowMatrix Problem::whitened_information(const Indices& chosen) const {
  const RowMatrix rows = whitened_rows(chosen);
  return whitened_fixed + product(rows.transpose(), rows);
}

RowMatrix Problem::information(const Indices& chosen) const {
  const RowMatrix rows = candidates.rows(chosen);
  return fixed + product(rows.transpose(), rows);
}

double Problem::log_det(const Indices& chosen) const {
  const RowMatrix factor = inverse_factor(whitened_information(chosen));
  return factor.size() == 0 ? -kInfinity : log_determinant(factor) + whitening.log_det;
}

Indices Problem::rounded(const Indices& order) const {
  Indices chosen;
  const auto take = [&](Index candidate) {
    if (size_of(chosen) < free_count && !candidates.excluded(candidate) &&
        spacing.fits(candidate, chosen)) {
      chosen.push_back(candidate);
    }
  };
  for (const Index candidate : order) {
    take(candidate);
  }
  for (Index j = 0; spacing.active() && j < candidates.size(); ++j) {
    if (!contains(chosen, j)) {
      take(j);
    }
  }
  return chosen;
}

Indices Problem::available(Index stride) const {
  Indices result;
  Index next = 0;  // so many to pass over
  for (Index j = 0; j < candidates.size(); ++j) {
    if (!candidates.excluded(j) && next-- == 0) {
      result.push_back(j);
      next = stride - 1;
    }
  }
  return result;
}

RowMatrix demanded_factor(const RowMatrix& information) {
  RowMatrix factor = inverse_factor(information);
  if (factor.size() == 0) {
    throw InvalidInput(
        "pose selection: the information of the poses is singular to rounding; the parameters are "
        "in units too different, or the candidates hardly show one of them");
  }
  return factor;
}

}  // namespace symkin::design::detail
