// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "symkin/support/types.hpp"

namespace symkin {

enum class ForwardStatus : std::uint8_t {
  converged,
  diverged,     // the closures have no solution that Newton's method reaches
  left_aspect,  // solved, but beyond a singularity: another assembly or working mode
};

struct ForwardKinematicsOptions {
  int max_iterations = 50;
  double step_tolerance = 1e-10;  // m, rad: the last Newton step, still applied, or the next
  void check() const;
};

// Arrays as the kernels take them: addresses and counts alone, since kernels that are compiled for
// other processors must not share a type with the rest (Eigen aligns its matrices differently).
struct LegValues {
  const double* parameters;
  int working_mode;
};

struct LegSpan {
  const LegValues* legs;
  Index count;
};

struct PoseSpan {
  const double* first;
  Index stride;  // from pose to pose; 0 repeats one
  Index count;
};

// Legs of one chain side by side, each with its own parameters at its own poses: of every number
// here those of all lanes stand one behind the other.
struct LegLanes {
  Index lanes;
  Index count;               // poses of a leg
  const double* parameters;  // p
  const double* poses;       // count x coordinates
  const double* readings;    // count
};

// The loops over poses of one chain with one sensor, for one kind of processor. Readings, margins
// and what is written have a row a pose, in it a column a leg (k where a leg has k closures).
struct LegKernels {
  void (*inverse)(LegSpan legs, PoseSpan poses, double* readings);
  void (*reach)(LegSpan legs, PoseSpan poses, double* margins);
  void (*by_pose)(LegSpan legs, PoseSpan poses, const double* readings, double* closures,
                  double* by_pose, double* by_reading);
  // Of one leg.
  void (*linearise)(const double* parameters, PoseSpan poses, const double* readings,
                    double* closures, double* by_parameters, double* by_pose, double* by_reading);
  // Of as many legs as the kernels have lanes. Rows as LegModel::linearise_lanes() writes them.
  Index lanes;
  void (*linearise_lanes)(const LegLanes& legs, double* rows);
  void (*forward)(LegSpan legs, PoseSpan start, const double* readings,
                  const ForwardKinematicsOptions& options, double* poses, ForwardStatus* status);
};

}  // namespace symkin
