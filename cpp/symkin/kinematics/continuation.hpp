// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/kinematics/forward_kinematics.hpp"

namespace symkin {

// The poses at readings (N x legs) that are reached from home without a jump: by small steps of the
// readings, and where these fail from the nearest row that was reached. Rows of `known` (N x
// coordinates, or none) that are finite are reached already. NaN where nothing leads to a pose.
RowMatrix continued(const Mechanism& mechanism, const RowMatrix& readings, ConstVector home,
                    const RowMatrix& known = {});

}  // namespace symkin
