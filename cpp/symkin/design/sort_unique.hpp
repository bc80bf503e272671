// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// Makes a set of candidates of a list: ascending, each once.
inline void sort_unique(std::vector<Index>& indices) {
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
}

}  // namespace symkin
