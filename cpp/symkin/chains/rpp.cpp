// SPDX-License-Identifier: MIT
#include "symkin/chains/rpp.hpp"

#include "symkin/chains/family.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(rpp, RppActive2, RppActive3)

}  // namespace symkin::chains
