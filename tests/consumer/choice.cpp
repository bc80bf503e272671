// SPDX-License-Identifier: MIT
// Pose selection alone: of four rows the two that are longest and at right angles.
#include <symkin/design/design.hpp>

int main() {
  symkin::RowMatrix rows(4, 2);
  rows << 2, 0, 1, 1, 0, 3, 1, 0;
  symkin::design::SelectionOptions options;
  options.count = 2;
  const auto found = symkin::design::select_poses(symkin::design::CandidateRows{rows}, options);
  return found.indices != std::vector<symkin::Index>{0, 2};
}
