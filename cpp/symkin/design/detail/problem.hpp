// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/detail/candidates.hpp"
#include "symkin/design/selection.hpp"

namespace symkin::design::detail {

// The demand that selected poses keep a distance from each other.
class Spacing {
 public:
  Spacing(const RowMatrix& coordinates, double minimum_distance)
      : coordinates_(coordinates), squared_(minimum_distance * minimum_distance) {}

  bool active() const { return squared_ > 0; }

  // Whether the two candidates may not both be selected.
  bool conflict(Index a, Index b) const {
    return active() && a != b &&
           (coordinates_.row(a) - coordinates_.row(b)).squaredNorm() < squared_;
  }

  bool fits(Index candidate, const Indices& chosen) const {
    return !active() || std::none_of(chosen.begin(), chosen.end(),
                                     [&](Index other) { return conflict(candidate, other); });
  }

 private:
  const RowMatrix& coordinates_;
  double squared_;
};

// D-optimality does not change under a linear map of the parameters, rounding does: the methods
// work on rows x T^T, for which the mean information of the candidates is the identity.
struct Whitening {
  RowMatrix transform;  // T, p x p lower triangular
  double log_det = 0;   // log det M = log det(whitened M) + log_det
};

// What every method works on. Required poses are part of the fixed information and no longer
// candidates, nor is what is forbidden or too near to a required pose.
struct Problem {
  // Throws as select_poses does.
  Problem(const RowSource& source, const SelectionOptions& options);

  const SelectionOptions& options;
  Spacing spacing;
  Candidates candidates;
  RowMatrix fixed;  // p x p, in the parameters' own units
  Whitening whitening;
  RowMatrix whitened_fixed;
  Index free_count;  // poses to choose beside the required ones

  Shape shape() const { return candidates.shape(); }
  Index parameters() const { return shape().parameters; }
  RowMatrix identity() const { return RowMatrix::Identity(parameters(), parameters()); }

  // The whitened rows of some candidates, one below the other and in columns.
  RowMatrix whitened_rows(const Indices& chosen) const;
  ColumnBlocks whitened(const Indices& chosen) const {
    return {whitened_rows(chosen), shape().rows};
  }

  // M of chosen candidates and all that is fixed, whitened and not.
  RowMatrix whitened_information(const Indices& chosen) const;
  RowMatrix information(const Indices& chosen) const;

  // log det of information(chosen); -infinity if it is singular.
  double log_det(const Indices& chosen) const;

  // T of a whitened W for the candidates' own rows, as the full passes need it.
  RowMatrix own_transform(const RowMatrix& whitened_factor) const {
    return whitened_factor * whitening.transform;
  }

  // As many candidates as are wanted: the first of `order` that may stand together, and if a
  // minimum distance leaves too few of these, any others that fit.
  Indices rounded(const Indices& order) const;

  // Candidates that are not excluded, every stride-th of them.
  Indices available(Index stride = 1) const;
};

// One function a method; the indices of what it found are those without the required ones, in any
// order, and the certificate has what the method itself proves.
Selection select_sun_hollerbach(const Problem& problem);
Selection select_exchange(const Problem& problem);
Selection select_exhaustive(const Problem& problem);
Selection select_random(const Problem& problem);

// The inverse factor of an information matrix; throws InvalidInput where there is none.
RowMatrix demanded_factor(const RowMatrix& information);

}  // namespace symkin::design::detail
