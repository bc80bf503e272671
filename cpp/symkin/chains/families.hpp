// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/leg_model.hpp"

// The chains that the registry knows, one function a family; each is instantiated in a source
// file of its own, because the models are the slowest templates to compile.
namespace symkin::chains {

using Models = std::vector<const LegModel*>;

Models ppr();
Models prp();
Models prr();
Models rpp();
Models rpr();
Models rrp();
Models rrr();
Models ups();

}  // namespace symkin::chains
