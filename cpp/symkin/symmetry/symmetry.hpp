// SPDX-License-Identifier: MIT
#pragma once

// The groups that carry a mechanism onto itself: their action on poses, legs, modes and readings,
// detection and verification.
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/carrying.hpp"
#include "symkin/symmetry/detection.hpp"
#include "symkin/symmetry/generation.hpp"
#include "symkin/symmetry/group.hpp"
#include "symkin/symmetry/pair.hpp"
#include "symkin/symmetry/pairs.hpp"
#include "symkin/symmetry/verification.hpp"
#include "symkin/symmetry/workspace_symmetry.hpp"
