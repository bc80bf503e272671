// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

enum class RowKind {
  paper,        // dg/dparam (Eqs. 8, 11), sensor units per parameter unit
  noise_aware,  // (dh/dparam) / sqrt(v): whitened closures, 1 per parameter unit
};

// Rows of the identification matrix C of one leg, k N x p, pose by pose, p its estimated parameters
// and k the chain's closures; NaN where the leg cannot reach. Of kind paper, the rows of further
// closures are those of what is left of them without the reading
// (ClosureRows::eliminate_reading), metres per parameter unit.
RowMatrix observability_rows(const Mechanism& mechanism, Index leg, ConstRows poses, RowKind kind,
                             const MeasurementNoise& noise = {});

// Rows of all legs at once, (N legs k) x the legs' estimated parameters, pose by pose: the
// traditional way to identify a mechanism. Of kind paper each leg has its own columns and rows
// (dg/dparam); noise-aware, the closures of a pose are whitened by their full covariance, since
// they share its noise, as the estimator `joint` does. NaN where a leg cannot reach. Throws
// InvalidInput where that covariance is singular: more legs than degrees of freedom need a noise of
// the readings.
RowMatrix mechanism_rows(const Mechanism& mechanism, ConstRows poses, RowKind kind,
                         const MeasurementNoise& noise = {});

// What a set of rows (N x p, N >= p) shows of the parameters.
struct Observability {
  // |R_ii| of the Householder QR in the parameters' order (Eq. 9). Unit-dependent, and so are the
  // indices: O1 as printed in Eq. 13.
  Vector r_diagonal;              // p
  std::array<double, 5> indices;  // O1 to O5 of the rows with the parameters in their scale

  // Free of units: columns scaled to length one.
  Vector singular_values;  // p, descending
  double condition;        // largest over smallest
  Index rank;              // singular values above 1e-10 of the largest
  // One direction a column for every missing rank: the combination of parameters, each in its
  // scale, that the rows do not show. p x (p - rank)
  RowMatrix null_directions;
};

// `scale` is a typical size of each parameter's error (the tolerances), p; O1 to O5 and the null
// directions are for parameters measured in it. Throws InvalidInput for fewer rows than columns, or
// a scale that is not p positive values.
Observability analyse_observability(ConstRows rows, ConstVector scale);

}  // namespace symkin
