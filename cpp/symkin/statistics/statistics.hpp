// SPDX-License-Identifier: MIT
#pragma once

// What numbers mean: distributions, bounds and tests that know no robots.
#include "symkin/statistics/distributions.hpp"
#include "symkin/statistics/drawing_conflict.hpp"
#include "symkin/statistics/fleet_tolerances.hpp"
#include "symkin/statistics/largest_error.hpp"
#include "symkin/statistics/quadratic_form.hpp"
