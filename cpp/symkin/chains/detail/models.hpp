// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/chains/point_platform.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin::chains {

using Models = std::vector<const LegModel*>;

// One model of each leg struct, alive until the program ends.
template <typename Leg>
const LegModel* model() {
  static const LegModelOf<Leg> instance;
  return &instance;
}

template <typename Leg>
void add_point_platform(Models& all) {
  if constexpr (can_carry_a_point<Leg>()) {
    all.push_back(model<PointPlatform<Leg>>());
  }
}

// The models of a family, those that carry a point behind the others.
template <typename... Legs>
Models models(ChainList<Legs...> /*chains*/) {
  Models all{model<Legs>()...};
  (add_point_platform<Legs>(all), ...);
  return all;
}

}  // namespace symkin::chains
