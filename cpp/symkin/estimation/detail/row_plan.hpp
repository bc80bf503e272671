// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/latent_kernels.hpp"
#include "symkin/estimation/observations.hpp"

namespace symkin {

// What one row of a latent pose is of.
struct RowOrigin {
  enum class Kind {
    closure,
    pose,
    reported,
    point,
    distance,
    height,
    attitude,
    turn,
    separation,
    rise,
    offset
  };
  Kind kind;
  // The leg, the component of the tangent, the point's coordinate, the anchor, the angle; between
  // poses the pair's number, or its coordinate.
  Index index;
  double by_error;  // of a closure: dh/dpsi, its deviation per deviation of the reading
  Index pose = -1;  // once it is a pose's
};

// The rows that poses have, those that were taken anywhere: the legs' closures, and behind them the
// observations' as the kernels take them.
struct RowPlan {
  std::vector<RowOrigin> origins;
  std::vector<LatentRows::Observation> observations;
  RowMatrix variances;       // N x rows, of a closure its reading's; -1 where it was not taken
  RowMatrix values;          // what was measured
  std::vector<Index> taken;  // rows of each pose
  Index basis = -1;          // see LatentRows
};

// `held`: whether both frames stay as the setup has them.
RowPlan planned_rows(const Mechanism& mechanism, const Observations& observations,
                     const Setup& setup, bool held);

// Its position and its rotation by rows.
void write_frame(const Frame& frame, double* to);

}  // namespace symkin
