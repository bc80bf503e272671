// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/error.hpp"

namespace symkin {

// A parameter has a value that no leg can have.
class ImpossibleLeg : public InvalidInput {
 public:
  using InvalidInput::InvalidInput;
};

}  // namespace symkin
