// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/observations.hpp"

namespace symkin {

// Where the latent poses of a fit start, N x coordinates: what was reported or measured in full,
// carried through the frames of the setup; else forward kinematics of the setup by continuation
// from the home pose along the readings. NaN where neither gives a pose of home's aspect.
RowMatrix starting_poses(const Mechanism& mechanism, const Setup& setup,
                         const Observations& observations, ConstVector home);

// The setup with the base frame, the target frame or both where the observations put them, the
// robot being as it is in the setup: closed forms for any rotation, refined by least squares.
// Throws InvalidInput if too few poses were measured, or none can be computed from its readings.
Setup with_starting_frames(const Mechanism& mechanism, const Setup& setup,
                           const Observations& observations, ConstVector home, bool base,
                           bool target);

}  // namespace symkin
