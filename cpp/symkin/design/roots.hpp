// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// T, lower triangular, with T^T T a positive semidefinite matrix; what is negative is ignored.
RowMatrix lower_root(const RowMatrix& matrix);

}  // namespace symkin
