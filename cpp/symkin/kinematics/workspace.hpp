// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "symkin/model/mechanism.hpp"

namespace symkin {

// The part of the workspace from which poses are taken.
struct WorkspaceOptions {
  // A box on the pose's coordinates: positions (m), then the angle or the rotation vector (rad). Of
  // those that the legs bind (see on_constraint), from where they are sought.
  Vector lower, upper;
  double reach_margin = 0;           // m, from every leg's stretch and fold
  double conditioning_limit = 20;    // largest condition number of dg/dpose
  double characteristic_length = 1;  // m, makes orientation and position comparable in it
  Vector home;                       // the pose whose aspect is meant, see on_constraint
  // Limits of the legs' sensor readings (sensor units), one a leg or one for all.
  Vector reading_lower = Vector::Constant(1, -std::numeric_limits<double>::infinity());
  Vector reading_upper = Vector::Constant(1, std::numeric_limits<double>::infinity());

  // Throws InvalidInput.
  void check(const Mechanism& mechanism) const;
};

// Such limits, one a leg.
Vector limits_of_legs(const Vector& limits, Index legs);

// Why a drawn pose was not taken.
struct WorkspaceRejections {
  Index reach = 0;         // a leg cannot reach it with the margin
  Index limits = 0;        // a reading is outside its limits
  Index aspect = 0;        // beyond a parallel singularity, as seen from home
  Index conditioning = 0;  // too near to a singularity
};

struct WorkspaceSample {
  RowMatrix poses;     // count x coordinates
  RowMatrix readings;  // count x legs
  Vector conditions;   // count: condition numbers of dg/dpose
  Index drawn = 0;     // poses drawn from the box
  WorkspaceRejections rejections;
};

// Poses uniform in the box that every leg reaches with the margin, well conditioned, in the aspect
// of home: the sign of det(dg/dpose) there (not asked of a mechanism with more legs than degrees
// of freedom, nor that the region be connected). The same seed gives the same poses. Throws
// InvalidInput that says which demand fails if home violates one, or if fewer than one pose in
// 20 000 drawn is taken.
WorkspaceSample sample_workspace(const Mechanism& mechanism, const WorkspaceOptions& options,
                                 Index count, std::uint64_t seed);

// Poses uniform in the box, whatever the mechanism can reach; NaN where the legs' bonds have none.
RowMatrix draw_poses(const Mechanism& mechanism, const WorkspaceOptions& options, Index count,
                     std::uint64_t seed);

// For each given pose whether the options admit it; the box is not asked.
std::vector<bool> inside_workspace(const Mechanism& mechanism, const WorkspaceOptions& options,
                                   ConstRows poses);

}  // namespace symkin
