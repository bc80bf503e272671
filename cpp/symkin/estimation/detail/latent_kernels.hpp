// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// N latent poses as the kernels take them: addresses and counts alone, as those of LegKernels. Of
// every pose there are m rows y + B x + C d + e = 0 (see PoseElimination): the legs' closures, and
// behind them those of the observations. A row that was not taken is zero.
struct LatentRows {
  struct OfLeg {
    const double *closure, *by_unknowns, *by_pose, *by_reading;  // `closures` rows a pose
    // Or of a leg with one closure, all of whose scalars are its free parameters, the packs as
    // LegModel::linearise_lanes() writes them; else null.
    const double* packs;
  };
  enum class Kind {
    position,
    orientation,
    reported_position,
    reported_orientation,
    point,
    distance,
    height,
    attitude,
    turn,
    position_along,
    point_along
  };
  // One observation, the same of all poses.
  struct Observation {
    Kind kind;
    Index values;   // where its measured ones begin
    Index own;      // of its own three scalars the first, among `scalars`
    Index rows[3];  // of its components, -1: nowhere measured
    Index zero;     // the scalar by which less is shown than is true, -1: none
  };
  // Where things stand in the room of a pack of poses.
  struct Places {
    Index misfits, variances, by_pose, by_unknowns, by_shared;  // y, V, B, C of legs and of others
    Index reflectors, diagonal, factors, lengths;  // B of rows of length one by QR, or B_b^-1
    Index conditions, rho, jacobian;               // G (m x r), G'y, G'C of the shared
    Index size;
  };

  Index count, legs, closures, dof, width;  // width: scalars of a leg
  Index rows, shared;                       // m; free scalars that are no leg's
  Index position;                           // of dof: coordinates of the position
  Index basis;  // where the rows of a pose begin that was measured in full everywhere; -1: nowhere
  const OfLeg* of_legs;
  const double* errors;     // N x legs, of the readings
  const double* variances;  // N x m, of a closure its reading's; below zero: not taken
  const Observation* observations;
  Index observation_count;
  const double* values;  // N x value_count
  Index value_count;
  const double* poses;  // N x coordinates
  Index coordinates;
  const double* bases;  // the base at every pose or, with stride 0, at all: N x 12, see write_frame
  Index base_stride;
  const double* base_turns;       // N x 18 where the base moves: of its turn w, exp([w]) and J_l(w)
  const double* target;           // 12
  const double* scalars;          // the observations' own
  const double* base_covariates;  // N x covariate_count
  Index covariate_count, first_slope;
  // Of the frames' twelve, of `scalars` and, from first_slope on, of the base's slopes: which
  // shared one, -1: held.
  const Index* shared_of;
  const Index* slots;  // dof, of the pose's tangent of six
  int directions;      // behind which all scalars are held
  Places places;
  double* room;  // N in packs x places.size
  // Of each pose: the sum of squares of its conditions, and whether these keep their digits; 0
  // where not, and then nothing is added.
  double *chi_squares, *clear;
};

struct LatentKernels {
  Index lanes;  // poses of a pack
  void (*eliminate)(const LatentRows& rows);
  // Adds what the poses say at their weights, in the legs' own scalars and behind them the shared:
  // to the gradient, and to the lower triangle of the information by blocks of scalars, if any.
  void (*add)(const LatentRows& rows, const double* weights, double* information, double* gradient);
  // The tangents of the poses (dof), and the new errors of their readings (legs), for a step of
  // those scalars.
  void (*move)(const LatentRows& rows, const double* step, double* tangents, double* errors);
};

// Those for this processor; results are the same on all.
const LatentKernels& latent_kernels();

}  // namespace symkin
