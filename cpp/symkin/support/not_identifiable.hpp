// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>

#include "symkin/support/error.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// The poses cannot show every parameter. `null_directions` has one column of unit length for each
// combination of parameters (in their own units) that no row sees; empty if only a number is wrong.
class NotIdentifiable : public Error {
 public:
  explicit NotIdentifiable(const std::string& message, RowMatrix directions = {})
      : Error(message), null_directions(std::move(directions)) {}

  RowMatrix null_directions;  // parameters x (parameters - rank)
};

}  // namespace symkin
