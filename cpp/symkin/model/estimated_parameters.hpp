// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/chain_info.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// Which of each leg's parameters (legs x p) are unknown, ascending; the others are held at their
// values, because they are constants of the description, given, or because others do the same. To
// move the point that a slider's travel counts from along its guide is to change the sensor's
// offset: of the point's radius, azimuth and height that one is held along which the guide runs
// most, the height first. So it is, but for a share that no measurement shows, with the height of
// driven legs that swing in planes between circles of equal radii.
std::vector<std::vector<Index>> estimated_parameters(const ChainInfo& chain, ConstRows parameters);

}  // namespace symkin
