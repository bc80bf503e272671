// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "symkin/model/chain_model.hpp"

namespace symkin {

using LegModels = std::vector<std::shared_ptr<const LegModel>>;  // one a leg

// Legs of several chains in one layout, so that their parameters are one array, legs x p: the names
// of all chains' geometry in the order in which they first appear, then those of the sensors. A
// leg's info says what each parameter is to this leg; what its chain does not have is absent, by
// which no derivative differs from zero. Legs of one chain share a model, which uses that chain's.
// Throws InvalidInput unless all carry the same platform and have one closure.
LegModels in_one_layout(const std::vector<const ChainModel*>& chains);

// The values of a chain's own parameters in such a layout, zero where there are none.
Vector in_layout(const ChainInfo& layout, const ChainInfo& chain, ConstVector parameters);

}  // namespace symkin
