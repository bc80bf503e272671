// SPDX-License-Identifier: MIT
#include "symkin/design/candidate_rows.hpp"

#include <string>

#include "symkin/support/error.hpp"

namespace symkin {

RowsInMemory::RowsInMemory(const CandidateRows& candidates)
    : rows_(candidates.rows), rows_per_pose_(candidates.rows_per_pose) {
  if (rows_per_pose_ < 1 || rows_.rows() % rows_per_pose_ != 0) {
    throw InvalidInput(std::to_string(rows_.rows()) + " rows do not make whole candidates of " +
                       std::to_string(rows_per_pose_) + " rows each");
  }
  if (rows_.rows() == 0 || rows_.cols() == 0) {
    throw InvalidInput("there are no candidates to select from (" + std::to_string(rows_.rows()) +
                       " rows of " + std::to_string(rows_.cols()) + " parameters)");
  }
  // A row stride would make the rows of one candidate not contiguous.
  if (rows_.rows() > 1 && rows_.outerStride() != rows_.cols()) {
    throw InvalidInput("the rows of the candidates must follow each other in memory");
  }
}

}  // namespace symkin
