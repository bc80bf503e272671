// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/chains/detail/kernels.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/support/processor.hpp"

namespace symkin::chains {

using Models = std::vector<const ChainModel*>;

// One model of each leg struct, alive until the program ends.
template <typename Leg>
const ChainModel* model(const LegKernels& kernels) {
  static const LegModelOf<Leg> instance(kernels);
  return &instance;
}

template <typename... Legs>
Models models(ChainList<Legs...> /*chains*/, const LegKernels* kernels) {
  Models all;
  (all.push_back(model<Legs>(*kernels++)), ...);
  return all;
}

// The models of a family, on the kernels for AVX2 where the processor has it.
template <typename Chains>
Models family_models([[maybe_unused]] const LegKernels* for_avx2) {
  using Legs = decltype(with_points(Chains()));
#ifdef SYMKIN_HAS_AVX2
  if (processor_has(Processor::avx2)) {
    return models(Legs(), for_avx2);
  }
#endif
  return models(Legs(), family_kernels<Scalar<xsimd::default_arch>, Chains>());
}

}  // namespace symkin::chains
