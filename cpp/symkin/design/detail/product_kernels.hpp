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

// Vectors u_k that squares are added of: rows of a matrix, the k-th with k + 1 values and then
// zeros if that is triangular.
struct Squares {
  const double* u;
  Index count, size;
  bool triangular;
  const double* scale;  // of each; 1 if null
};

// Rows C of a candidate as the values of each row in its span, one row after the other. Where they
// are mixed these are rows of G with C = W G, and then come the factors of W below its diagonal of
// ones, by rows: `width` values in all.
struct RowForm {
  const Span* spans;
  Index rows;
  Index factors;  // values before them
  Index width;
  bool mixed;
};

// The loops over candidates, in which pose selection spends its time, for one kind of processor;
// see cmake/SymkinKernels.cmake.
struct ProductKernels {
  // The largest value of each group.
  void (*find_largest)(const double* values, double* of_groups, Index groups);

  // D += scale_k (x u_k) (x u_k)^T for a block of candidates, one k after the other. D is their
  // traces and, unless it is null, the lower triangle by rows.
  void (*add_squares)(const double* x, Shape shape, const Squares& squares, double* gram,
                      double* trace);

  // The diagonal of D alone, of_rows[row * kBlock + candidate].
  void (*add_row_squares)(const double* x, const RowForm& form, const Squares& squares,
                          double* of_rows);

  // The largest product of 1 + d over a candidate's rows, in each group of a block.
  void (*find_largest_products)(const double* of_rows, Index rows, double* of_groups);

  // base * det(I + D_jj + E S E^T) of a group of candidates, 0 of those hidden; returns the
  // largest.
  double (*find_ratios)(const double* x, Shape shape, const double* gram, const double* trace,
                        LeavingRows leaving, double* ratios);
};

// Those for this processor.
const ProductKernels& product_kernels();

}  // namespace symkin::design::detail
