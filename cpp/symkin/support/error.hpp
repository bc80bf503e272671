// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

namespace symkin {

// Base of everything that the library throws on purpose. The message names the value, what was
// expected and where.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An argument or an option is outside what the function accepts.
class InvalidInput : public Error {
 public:
  using Error::Error;
};

// A fit has gone to where no mechanism is.
class FailedFit : public InvalidInput {
 public:
  using InvalidInput::InvalidInput;
};

// A declared symmetry is not there; the message names leg, parameter and deviation.
class SymmetryMismatch : public Error {
 public:
  using Error::Error;
};

}  // namespace symkin
