// SPDX-License-Identifier: MIT
#include "symkin/chains/ppr.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models ppr() {
  return {model<LegModelOf<PprActive1>>(), model<LegModelOf<PprActive2>>(),
          model<LegModelOf<PointPlatform<PprActive1>>>(),
          model<LegModelOf<PointPlatform<PprActive2>>>()};
}

}  // namespace symkin::chains
