// SPDX-License-Identifier: MIT
#include "symkin/chains/prr.hpp"

#include "symkin/chains/families.hpp"
#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

Models prr() {
  return {model<LegModelOf<PrrActive1>>(), model<LegModelOf<PrrActive2>>(),
          model<LegModelOf<PrrActive3>>(), model<LegModelOf<PointPlatform<PrrActive1>>>(),
          model<LegModelOf<PointPlatform<PrrActive2>>>()};
}

}  // namespace symkin::chains
