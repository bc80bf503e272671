// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/detail/blocks.hpp"
#include "symkin/support/processor.hpp"

namespace symkin::design::detail {

// Of Leaving, by rows.
struct LeavingRows {
  const double* y;
  const double* s;
  double base;
};

// The loops over candidates, in which pose selection spends its time, for one kind of processor;
// see cmake/SymkinKernels.cmake.
struct ProductKernels {
  // The largest value of each group.
  void (*find_largest)(const double* values, double* of_groups, Index groups);

  // D += scale (x u) (x u)^T for a block of candidates, u with `size` values and then zeros. D is
  // their traces and, unless it is null, the lower triangle by rows.
  void (*add_squares)(const double* x, Shape shape, const double* u, Index size, double scale,
                      double* gram, double* trace);

  // base * det(I + D_jj + E S E^T) of a group of candidates, 0 of those hidden; returns the
  // largest.
  double (*find_ratios)(const double* x, Shape shape, const double* gram, const double* trace,
                        LeavingRows leaving, double* ratios);
};

// Those for this processor.
const ProductKernels& product_kernels();

}  // namespace symkin::design::detail
