// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "symkin/chains/declared/declared_model.hpp"
#include "symkin/model/chain_model.hpp"

namespace symkin {

// The model of a chain, written from base to platform with the actuated joint in brackets, as in
// "[R]RR"; with a ball where a universal joint would do, as in "S[P]S", the chain that has that.
// Throws InvalidInput that names the nearest chain, or why the chain cannot be used.
const ChainModel& leg_model(std::string_view chain, Platform platform = Platform::rigid);

// Makes a declared leg a chain that leg_model() finds by its name, as long as the program runs. A
// name that is taken keeps its chain.
const ChainModel& declare_chain(const declared::Declaration& declaration);

// Names of the chains for a platform, without declared ones.
std::vector<std::string> chain_names(Platform platform = Platform::rigid);

// "rigid", "point", "translating" or "spherical"; throws InvalidInput otherwise.
Platform platform_named(std::string_view name);

}  // namespace symkin
