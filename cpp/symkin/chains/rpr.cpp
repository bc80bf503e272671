// SPDX-License-Identifier: MIT
#include "symkin/chains/rpr.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models rpr() {
  return {model<LegModelOf<RprActive1>>(), model<LegModelOf<RprActive2>>(),
          model<LegModelOf<RprActive3>>(), model<LegModelOf<PointPlatform<RprActive1>>>(),
          model<LegModelOf<PointPlatform<RprActive2>>>()};
}

}  // namespace symkin::chains
