// SPDX-License-Identifier: MIT
#pragma once

// What a mechanism does: inverse and forward kinematics, jacobians, singularities, workspace.
#include "symkin/kinematics/constraint.hpp"
#include "symkin/kinematics/continuation.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/kinematics/workspace.hpp"
