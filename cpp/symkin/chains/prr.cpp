// SPDX-License-Identifier: MIT
#include "symkin/chains/prr.hpp"

#include "symkin/chains/family.hpp"
#include "symkin/chains/point_platform.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(prr, PrrActive1, PrrActive2, PrrActive3, PointPlatform<PrrActive1>, PointPlatform<PrrActive2>)

}  // namespace symkin::chains
