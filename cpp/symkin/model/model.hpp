// SPDX-License-Identifier: MIT
#pragma once

// What a mechanism is: pose spaces, the parameters of a leg with their roles, and the one place
// where a chain's compile-time closure meets run time (LegModel). Public: all but leg_model_of.hpp,
// which only somebody who adds a chain includes.
#include "symkin/model/chain_info.hpp"
#include "symkin/model/leg_model.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/model/pose.hpp"
