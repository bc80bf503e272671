// SPDX-License-Identifier: MIT
#pragma once

// The base on which all rooms stand: errors, random streams, threads, decompositions.
#include "symkin/support/csv_table.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"
#include "symkin/support/parallel.hpp"
#include "symkin/support/random.hpp"
#include "symkin/support/types.hpp"
