// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin::detail {

// Draws that are held together, those of each column one after the other.
constexpr Index kDraws = 512;

// largest[d] = max over poses of |E_j x_d|^2: `moves` are the E_j, one below the other, with `rows`
// rows each; column c of the draws x_d begins at draws + c * kDraws. For one kind of processor; see
// cmake/SymkinKernels.cmake.
using FindLargest = void (*)(const double* moves, Index poses, Index rows, Index columns,
                             const double* draws, double* largest);

// That for this processor.
FindLargest find_largest();

}  // namespace symkin::detail
