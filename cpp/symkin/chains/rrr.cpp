// SPDX-License-Identifier: MIT
#include "symkin/chains/rrr.hpp"

#include "symkin/chains/family.hpp"
#include "symkin/chains/point_platform.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(rrr, RrrActive1, RrrActive2, RrrActive3, PointPlatform<RrrActive1>, PointPlatform<RrrActive2>)

}  // namespace symkin::chains
