// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// What of the errors E x, rows of all poses stacked, the best choice of some other unknowns f, as
// the place of a frame that nobody needs, does not make good: E - G (G'G)^-1 G'E, where G f are the
// same errors by them. Errors that only an unknown frame has are gone.
RowMatrix projected_effects(ConstRows effects, ConstRows by_frames);

}  // namespace symkin
