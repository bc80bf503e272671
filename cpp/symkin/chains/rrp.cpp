// SPDX-License-Identifier: MIT
#include "symkin/chains/rrp.hpp"

#include "symkin/chains/family.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(rrp, RrpActive1, RrpActive2, RrpActive3)

}  // namespace symkin::chains
