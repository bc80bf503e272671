// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// End-effector errors over poses: the position error is a distance, the orientation error an angle.
struct PoseErrors {
  RowMatrix differences;  // N x dof: taken less commanded, on the tangent; NaN where not evaluated
  Index evaluated = 0;
  Index failed = 0;  // poses that the mechanism cannot take, left out of the figures
  double position_rms = 0, position_max = 0;        // m
  double orientation_rms = 0, orientation_max = 0;  // rad
};

// Difference between the pose that the actual mechanism takes, when the joints are commanded
// through the model's inverse kinematics, and the commanded pose, which the model can take (see
// on_constraint).
PoseErrors command_errors(const Mechanism& actual, const Mechanism& model, ConstRows commanded);

// Difference between the model's forward kinematics at measured readings and the measured pose.
PoseErrors measurement_errors(const Mechanism& model, ConstRows measured, ConstRows readings);

}  // namespace symkin
