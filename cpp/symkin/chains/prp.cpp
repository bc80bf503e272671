// SPDX-License-Identifier: MIT
#include "symkin/chains/prp.hpp"

#include "symkin/chains/family.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(prp, PrpActive1, PrpActive3)

}  // namespace symkin::chains
