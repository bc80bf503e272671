// SPDX-License-Identifier: MIT
#include "symkin/statistics/projected_effects.hpp"

#include <string>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {

RowMatrix projected_effects(ConstRows effects, ConstRows by_frames) {
  if (effects.rows() != by_frames.rows()) {
    throw InvalidInput("the effects have " + std::to_string(effects.rows()) +
                       " rows and those of the frames " + std::to_string(by_frames.rows()) +
                       "; expected as many");
  }
  if (!effects.allFinite() || !by_frames.allFinite()) {
    throw InvalidInput("effects are not finite");
  }
  if (by_frames.cols() == 0) {
    return effects;
  }
  constexpr double kSame = 1e-10;  // columns that others have already
  const RowMatrix scaled = by_frames * inverse_column_lengths(by_frames).asDiagonal();
  const RowMatrix basis = column_space(scaled, kSame).basis;
  return effects - product(basis, product(basis.transpose(), effects));
}

}  // namespace symkin
