// SPDX-License-Identifier: MIT
#include "symkin/chains/ppr.hpp"

#include "symkin/chains/family.hpp"
#include "symkin/chains/point_platform.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(ppr, PprActive1, PprActive2, PointPlatform<PprActive1>, PointPlatform<PprActive2>)

}  // namespace symkin::chains
