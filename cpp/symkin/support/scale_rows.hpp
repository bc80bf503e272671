// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// Each row times its factor, in place: expressions over the columns of rows are slow.
inline void scale_rows(RowMatrix& rows, const Vector& factors) {
  for (Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) *= factors[i];
  }
}

}  // namespace symkin
