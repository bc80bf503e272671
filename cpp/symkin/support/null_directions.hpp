// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// The same space, spanned by directions (columns) that are easy to name: each has a parameter that
// the others do not have, and as few more as that leaves. `directions` have parameters in
// comparable scales; `scale` (p) turns them into those of the result, whose columns have length
// one.
RowMatrix named_directions(RowMatrix directions, const Vector& scale);

}  // namespace symkin
