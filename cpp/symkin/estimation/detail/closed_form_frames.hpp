// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/frame.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// A pair of the robot's pose P and what the device saw of it, Y = B P T.
struct SeenPose {
  Frame robot, seen;
};

struct FramePair {
  Frame base, target;
};

// Tilts below this, rad, do not tell the target's place on the platform: the robot is not yet what
// it will be found to be.
inline constexpr double kHardlyTilted = 0.02;

// Directions of the platform, columns, in which its tilts show where the target is.
RowMatrix shown_places(const std::vector<SeenPose>& pairs);

// What is wanted: frames that are unknown, and whether all pairs have their orientation.
struct FrameQuestion {
  PoseSpace space;
  bool all_turned, base, target;
};

// Where the pairs put the frames, by every closed form that serves, the given ones first: for any
// rotation; which is best depends on how far the platform moves and tilts.
std::vector<FramePair> closed_form_frames(const std::vector<SeenPose>& pairs,
                                          const FramePair& given, const FrameQuestion& asked);

}  // namespace symkin
