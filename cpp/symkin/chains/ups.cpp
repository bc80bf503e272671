// SPDX-License-Identifier: MIT
#include "symkin/chains/ups.hpp"

#include "symkin/chains/family.hpp"

namespace symkin::chains {

SYMKIN_FAMILY(ups, UpsActive2)

}  // namespace symkin::chains
