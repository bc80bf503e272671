// SPDX-License-Identifier: MIT
#include "symkin/chains/prp.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models prp() { return {model<LegModelOf<PrpActive1>>(), model<LegModelOf<PrpActive3>>()}; }

}  // namespace symkin::chains
