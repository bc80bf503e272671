// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// What observations at poses would say of the columns of a layout, before anything is measured:
// of each pose the whitened rows that fit_jointly would have, (N r) x columns, pose by pose. The
// observations are the exact values at the poses (N x coordinates), with their deviations. r is the
// largest number of conditions of a pose; one with fewer has rows of zeros behind its own, and one
// that is not finite has rows of NaN.
// Throws InvalidInput where the observations do not fit the mechanism, or exact ones are redundant.
RowMatrix observed_rows(const Mechanism& mechanism, const Setup& setup,
                        const Observations& observations, const Layout& layout, ConstRows poses);

}  // namespace symkin
