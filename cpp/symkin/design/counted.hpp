// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "symkin/support/types.hpp"

namespace symkin {

// "1 row", "2 rows".
inline std::string counted(Index count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace symkin
