// SPDX-License-Identifier: MIT
#pragma once

// Choosing the rows of an identification: which of many candidates, each with a block of rows of
// the information matrix, to measure so that a criterion of the parameters is best, how far the
// choice is from the best possible, and what to measure next. It knows rows and criteria and no
// robots; it needs symkin_support alone. Public: row_source.hpp and selection.hpp; what is in
// detail is not installed.
#include "symkin/design/row_source.hpp"
#include "symkin/design/selection.hpp"
