// SPDX-License-Identifier: MIT
#pragma once

namespace symkin {

// Kinds of processors for which kernels are compiled beside those that run everywhere; see
// cmake/SymkinKernels.cmake. Each has what those before it have.
enum class Processor { any, avx2, avx512 };

// The kind of this one.
Processor processor();

// Whether this one has it; what is compiled for this machine alone knows.
#ifdef SYMKIN_PROCESSOR
constexpr bool processor_has(Processor kind) { return Processor::SYMKIN_PROCESSOR >= kind; }
#else
inline bool processor_has(Processor kind) { return processor() >= kind; }
#endif

}  // namespace symkin
