// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/batched_leg.hpp"
#include "symkin/model/chain_legs.hpp"
#include "symkin/model/newton.hpp"

namespace symkin {

// The kernels of a leg for one scalar: doubles, or batches of them where the processor has them.
template <typename Leg, typename Sensor, typename T>
constexpr LegKernels leg_kernels() {
  using Batched = detail::BatchedLeg<Leg, Sensor, T>;
  return {Batched::inverse,
          Batched::reach,
          Batched::by_pose,
          Batched::linearise,
          Lanes<T>::kCount,
          Batched::linearise_lanes,
          detail::Newton<detail::ChainLegs<Leg, Sensor, T>>::forward};
}

}  // namespace symkin
