// SPDX-License-Identifier: MIT
#include "symkin/chains/ups.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models ups() { return {model<LegModelOf<UpsActive2>>()}; }

}  // namespace symkin::chains
