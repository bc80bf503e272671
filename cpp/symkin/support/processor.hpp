// SPDX-License-Identifier: MIT
#pragma once

namespace symkin {

// Kinds of processors for which kernels are compiled beside those that run everywhere; see
// cmake/SymkinKernels.cmake. Each has what those before it have.
enum class Processor { any, avx2, avx512 };

// The kind of this one.
Processor processor();

}  // namespace symkin
