// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "symkin/design/row_source.hpp"
#include "symkin/support/types.hpp"

namespace symkin::design {

enum class SelectionMethod {
  sun_hollerbach,  // active calibration: grow, then add one and drop one (for comparison)
  exchange,        // approximate design, rounding, exchange, kicks, full verification
  exhaustive,      // exchange, then branch and bound until the optimum is proven or time is up
  random,          // a seeded draw
  all,             // every candidate that is not forbidden; count is not used
};

// What is made as large as possible (expected_error: as small). With the singular values s of the
// selected rows (and of the prior's), parameters in units of the column scale:
// O1 = (s_1 ... s_p)^(1/p) / p, O2 = s_p / s_1, O3 = s_p, O4 = s_p^2 / s_1, O5 = 1 / sum(1 / s_i),
// expected_error = trace(M^-1 B).
enum class Criterion { O1, O2, O3, O4, O5, expected_error };

struct SelectionOptions {
  Index count = 0;  // poses to select, the required ones included
  SelectionMethod method = SelectionMethod::exchange;
  Criterion criterion = Criterion::O1;
  std::uint64_t seed = 1;
  int restarts = 10;            // sun_hollerbach: random starts
  int kicks = 60;               // exchange: disturbances of the best set
  std::vector<Index> required;  // candidates that must be selected
  std::vector<bool> forbidden;  // n flags, or none
  RowMatrix prior;              // p x p information of what is measured already, or empty
  RowMatrix coordinates;        // n x m: where the candidates are, for the distance
  double minimum_distance = 0;  // between any two selected poses, in the coordinates' unit
  Vector column_scale;          // p: unit of each parameter in O1 to O5; empty: ones
  RowMatrix error_weight;       // p x p: B of expected_error
  double time_limit_s = 10;     // exhaustive
  Index spare_count = 0;        // further poses to name
  int threads = 0;              // 0: as many as the machine has; the result is the same
  // Rows that a source makes are kept up to so much memory; beyond it they are made again in each
  // of the passes over all candidates, usually four: slower, but in little memory.
  Index memory_limit_bytes = Index{768} << 20U;

  // Throws InvalidInput for n candidates of r rows and p parameters.
  void check(Index candidates, Index rows_per_pose, Index parameters) const;
};

// How far a selection can be from the best possible. For any positive definite W and any set S,
// det M_S <= det W (trace(W^-1 M_S) / p)^p; over all sets the trace is at most that of the fixed
// information and of the N largest d_j (no pose twice), or of N times the largest (repeats
// allowed, the bound of Kiefer and Wolfowitz). Efficiencies are (det M_S / bound)^(1/p).
struct Certificate {
  double log_det_bound_repeats = std::numeric_limits<double>::infinity();
  double log_det_bound_distinct = std::numeric_limits<double>::infinity();
  double efficiency_repeats = 0;
  double efficiency_distinct = 0;
  // Of the criterion that was optimised: no set without repeats has a larger O1 to O5, or a smaller
  // expected error. The efficiency is that of the determinant for O1, value / bound for O2 to O5,
  // and bound / value for the expected error.
  double criterion_bound = 0;
  double criterion_efficiency = 0;
  bool proven_optimal = false;  // no other set is better by more than rounding

  // Takes over smaller bounds of log det M.
  void tighten(double repeats, double distinct) {
    log_det_bound_repeats = std::min(log_det_bound_repeats, repeats);
    log_det_bound_distinct = std::min({log_det_bound_distinct, distinct, repeats});
  }
};

struct Selection {
  std::vector<Index> indices;  // ascending
  double log_det = 0;          // log det M of the selected rows and the prior
  double criterion_value = 0;
  Certificate certificate;
  std::vector<Index> spares;  // each the best addition to the selection and the spares before it
  Index nodes = 0;            // of the branch and bound
};

// Throws InvalidInput for options that do not fit, and NotIdentifiable with the directions in
// parameter space if no selection shows every parameter.
Selection select_poses(const RowSource& candidates, const SelectionOptions& options);
Selection select_poses(const CandidateRows& candidates, const SelectionOptions& options);

}  // namespace symkin::design
