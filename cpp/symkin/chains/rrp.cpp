// SPDX-License-Identifier: MIT
#include "symkin/chains/rrp.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models rrp() {
  return {model<LegModelOf<RrpActive1>>(), model<LegModelOf<RrpActive2>>(),
          model<LegModelOf<RrpActive3>>()};
}

}  // namespace symkin::chains
