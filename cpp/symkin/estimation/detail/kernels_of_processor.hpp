// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/chains/detail/kernels.hpp"
#include "symkin/support/processor.hpp"

// Defines `const Table& name()`, the Of<T>::kTable of the most lanes T that the processor has, at
// the end of a source that is compiled for several kinds of processors (chains/detail/kernels.hpp).
#if defined(SYMKIN_COMPILES_AVX2)
#define SYMKIN_KERNELS_OF_PROCESSOR(Table, name, Of) \
  const Table* name##_avx2() { return &Of<chains::Scalar<xsimd::avx2>>::kTable; }
#elif defined(SYMKIN_HAS_AVX2)
#define SYMKIN_KERNELS_OF_PROCESSOR(Table, name, Of)                                         \
  const Table* name##_avx2();                                                                \
  const Table& name() {                                                                      \
    return processor_has(Processor::avx2) ? *name##_avx2()                                   \
                                          : Of<chains::Scalar<xsimd::default_arch>>::kTable; \
  }
#else
#define SYMKIN_KERNELS_OF_PROCESSOR(Table, name, Of) \
  const Table& name() { return Of<chains::Scalar<xsimd::default_arch>>::kTable; }
#endif
