// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/column_blocks.hpp"

namespace symkin {

// Candidates as points: like ones are near each other. A row and its negative bring the same
// information, so each row is turned to one side first.
RowMatrix candidate_points(const ColumnBlocks& candidates, Index parameters);

// The cluster of each point: centres are taken one after the other where the points are farthest
// from all centres so far (Gonzalez 1985). At most `count` clusters, none empty.
std::vector<Index> farthest_first_clusters(const RowMatrix& points, Index count);

}  // namespace symkin
