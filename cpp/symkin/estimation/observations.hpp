// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/estimation/unknowns.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// Values with their standard deviations, a row a pose; NaN where nothing was measured. Without
// columns, nothing of the kind was.
struct Observed {
  RowMatrix values;
  RowMatrix deviations;  // as many rows; zero: exact
  // Of places, where their errors are not independent along the coordinates: nine of each place,
  // the axes along which they are, by rows; the deviations are of these. A coordinate that was not
  // measured has its own place among the axes, alone. Without columns: the coordinates.
  RowMatrix axes = {};

  bool any() const { return values.cols() > 0; }
  bool any(Index pose) const { return any() && !values.row(pose).array().isNaN().all(); }
  Observed of(const std::vector<Index>& poses) const;
};

// What was observed at N poses, whose true values nobody knows: any mixture, each with its noise.
struct Observations {
  Observed readings;  // N x legs
  // The target's pose in the device's frame: coordinates as in PoseSpace, any of them missing (a
  // quaternion as a whole); deviations N x dof.
  Observed poses;
  // The platform's pose in the base's frame, as a controller reports it; the same columns.
  Observed reported;
  Observed points;     // N x (points * dimensions), device's frame
  Observed distances;  // N x anchors, from the target
  Observed heights;    // N x 1, of the target above the plane: 0 where a probe touches it
  Observed attitudes;  // N x 3, roll, pitch and yaw of the target in the device's frame
  Observed turns;      // N x 1, about an axis of length one in the device's frame, N x 3
  RowMatrix turn_axes;
  // What was measured between two poses, up to k of each: the other pose, -1: none; how far the
  // target is from the target there, N x k; how much higher above the plane, N x k; how far along
  // each coordinate of the device's frame, N x (k * dimensions).
  RowMatrix partners;
  Observed separations, rises, offsets;
  // The covariates that the slopes of the setup multiply, known exactly: of the legs' slopes k
  // blocks of N x legs side by side, and N x k of the base's. Without columns all are zero.
  RowMatrix leg_covariates, base_covariates;

  // Readings and poses alone, of the same noise everywhere.
  static Observations in_full(PoseSpace space, const MeasurementSet& measurements,
                              const MeasurementNoise& noise);
  Index count() const { return readings.values.rows(); }
  bool any(Index pose) const;               // whether anything was observed there
  bool couples(Index pose, Index k) const;  // whether anything of this pair was measured
  // Without what was measured between these and others.
  Observations of(const std::vector<Index>& some) const;
  void check(const Mechanism& mechanism, const Setup& setup) const;  // throws InvalidInput
};

}  // namespace symkin
