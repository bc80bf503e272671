// SPDX-License-Identifier: MIT
#pragma once

// All of symkin. Pose selection alone, which knows no robots, is symkin/design/design.hpp.
#include "symkin/chains/chains.hpp"
#include "symkin/estimation/estimation.hpp"
#include "symkin/kinematics/kinematics.hpp"
#include "symkin/model/model.hpp"
#include "symkin/statistics/statistics.hpp"
#include "symkin/symmetry/symmetry.hpp"
