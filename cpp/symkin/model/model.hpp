// SPDX-License-Identifier: MIT
#pragma once

// What a mechanism is: pose spaces, the parameters of a leg with their roles, its sensor, the one
// place where a chain's compile-time closure meets run time (ChainModel), and the layout in which
// legs of different chains stand side by side. Public: all of it; what is not named here only
// somebody who adds a chain includes, by way of leg_model_of.hpp.
#include "symkin/model/chain_info.hpp"
#include "symkin/model/chain_model.hpp"
#include "symkin/model/leg_constraint.hpp"
#include "symkin/model/leg_layout.hpp"
#include "symkin/model/leg_model.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/model/pose_manifold.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/model/roles.hpp"
