// SPDX-License-Identifier: MIT
#include "symkin/chains/rpp.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models rpp() { return {model<LegModelOf<RppActive2>>(), model<LegModelOf<RppActive3>>()}; }

}  // namespace symkin::chains
