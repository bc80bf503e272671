// SPDX-License-Identifier: MIT
#include "symkin/chains/rpr.hpp"

#include "symkin/chains/family.hpp"
#include "symkin/chains/point_platform.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(rpr, RprActive1, RprActive2, RprActive3, PointPlatform<RprActive1>, PointPlatform<RprActive2>)

}  // namespace symkin::chains
