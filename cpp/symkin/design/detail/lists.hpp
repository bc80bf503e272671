// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin::design::detail {

// Candidates, or places in another list.
using Indices = std::vector<Index>;

template <typename List>
decltype(auto) at(List& list, Index i) {
  return list[static_cast<std::size_t>(i)];
}

template <typename List>
Index size_of(const List& list) {
  return static_cast<Index>(list.size());
}

inline bool contains(const Indices& list, Index value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

// Makes a set of a list: ascending, each once.
inline void sort_unique(Indices& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

// What a list of places names in another list.
inline Indices named(const Indices& places, const Indices& list) {
  Indices result;
  result.reserve(places.size());
  for (const Index place : places) {
    result.push_back(at(list, place));
  }
  return result;
}

// "1 row", "2 rows".
inline std::string counted(Index count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace symkin::design::detail
