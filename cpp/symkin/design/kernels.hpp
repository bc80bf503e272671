// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/design/column_blocks.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// The arithmetic over one block of candidates. x is the block (rows r x parameters p columns),
// `gram` its r (r + 1) / 2 columns of C_j A C_j^T (lower triangle by rows), `trace` their traces
// d_j, `group_max` the largest trace of each group. With r = 1 gram and trace are the same numbers
// and gram may be null.
struct Shape {
  Index rows = 1;
  Index parameters = 0;

  Index width() const { return rows * parameters; }
  Index gram_size() const { return rows * (rows + 1) / 2; }
};

constexpr Index kMaxRows = 36;  // rows a candidate may have

// A pose that may leave the selection, as the pair kernel sees it. The ratio of the determinants
// after and before the exchange for candidate j is base * det(I + D_jj + E S E^T), E = X_j Y^T.
struct Leaving {
  const double* y;  // rows x parameters: C_i A, in the coordinates of x
  const double* s;  // rows x rows: (I - D_ii)^-1; unused with one row
  double base;      // det(I - D_ii)
  double trace;     // d_i
};

// The best exchange so far; `lane` is set only where the kernel finds a better one.
struct BestPair {
  double ratio = 1;
  Index lane = -1;
};

struct Kernels {
  // z = x T^T for the lower triangular T (p x p by rows), row by row.
  void (*transform)(const double* x, const double* t, Shape shape, double* z);
  // trace of x T^T T x^T.
  void (*variance)(const double* x, const double* t, Shape shape, double* trace, double* group_max);
  // gram and trace of x T^T T x^T.
  void (*gram)(const double* x, const double* t, Shape shape, double* gram, double* trace,
               double* group_max);
  // gram += scale (x u) (x u)^T, trace likewise.
  void (*gram_update)(const double* x, const double* u, double scale, Shape shape, double* gram,
                      double* trace, double* group_max);
  // sum += x^T x, lower triangle.
  void (*outer_sum)(const double* x, Shape shape, double* sum);
  // The best candidate of the block to take the place of `leaving`.
  void (*best_pair)(const double* x, const double* gram, const double* trace,
                    const double* group_max, const Leaving& leaving, Shape shape, BestPair& best);
  const char* name;
};

// The widest variant that this processor runs.
const Kernels& kernels();

}  // namespace symkin
