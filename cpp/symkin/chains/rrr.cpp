// SPDX-License-Identifier: MIT
#include "symkin/chains/rrr.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models rrr() {
  return {model<LegModelOf<RrrActive1>>(), model<LegModelOf<RrrActive2>>(),
          model<LegModelOf<RrrActive3>>(), model<LegModelOf<PointPlatform<RrrActive1>>>(),
          model<LegModelOf<PointPlatform<RrrActive2>>>()};
}

}  // namespace symkin::chains
