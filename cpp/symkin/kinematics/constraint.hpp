// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// Legs with more closures than one bind the platform (3-RPS, 3-PRS): of its coordinates, position
// and then rotation vector, only free_coordinates() can be chosen. The poses with these
// as they are given and the others as the closures without the reading have them, by Newton's
// method from the given ones; NaN where it finds none. Of other mechanisms the poses as given.
RowMatrix on_constraint(const Mechanism& mechanism, ConstRows poses);

}  // namespace symkin
