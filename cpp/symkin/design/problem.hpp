// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "symkin/design/candidate_blocks.hpp"
#include "symkin/design/selection.hpp"
#include "symkin/design/spacing.hpp"
#include "symkin/design/whitening.hpp"

namespace symkin {

// What every method works on. Required poses are part of the fixed information and no longer
// candidates, nor is what is forbidden or too near to a required pose.
struct SelectionProblem {
  // Throws as select_poses does.
  SelectionProblem(const RowSource& source, const SelectionOptions& options);

  const SelectionOptions& options;
  Spacing spacing;
  CandidateBlocks candidates;
  RowMatrix fixed;  // p x p, in the parameters' own units
  Whitening whitening;
  RowMatrix whitened_fixed;
  Index free_count;  // poses to choose beside the required ones

  Index parameters() const { return candidates.shape().parameters; }

  // The whitened rows of some candidates.
  ColumnBlocks whitened(const std::vector<Index>& indices) const;

  // M of chosen candidates and all that is fixed, whitened and not.
  RowMatrix whitened_information(const std::vector<Index>& chosen) const;
  RowMatrix information(const std::vector<Index>& chosen) const;

  // log det of information(chosen); -infinity if it is singular.
  double log_det(const std::vector<Index>& chosen) const;

  // T of a whitened W for the candidates' own rows, as the full passes need it.
  RowMatrix own_transform(const RowMatrix& whitened_factor) const {
    return whitened_factor * whitening.transform;
  }
};

// What a method found: the chosen candidates, without the required ones.
struct Choice {
  std::vector<Index> chosen;
  Certificate certificate;
  Index exchanges = 0;
  Index passes = 0;
  Index nodes = 0;
};

// One function a method, each in its own file.
Choice select_sun_hollerbach(const SelectionProblem& problem);
Choice select_exchange(const SelectionProblem& problem);
Choice select_exhaustive(const SelectionProblem& problem);
Choice select_random(const SelectionProblem& problem);
Choice select_all(const SelectionProblem& problem);

}  // namespace symkin
