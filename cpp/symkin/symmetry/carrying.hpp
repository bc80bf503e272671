// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"
#include "symkin/symmetry/pair.hpp"

namespace symkin {

// The image of a leg under a pair, in the coordinates of `like`: a leg at about the place where it
// arrives, whose constants it takes (the azimuths that directions are given from) and whose
// angles, signs of radii and senses of guides and axes it comes nearest to. The leg at g X h^-1
// does what the given one does at X, with the reading's sign of the joint (see JointMap). Throws
// InvalidInput for an exchange, and for a leg that has no such image, as arcs that another mode
// would need.
Leg carried_leg(const ChainInfo& chain, const Leg& leg, const SymmetryPair& pair, const Leg& like);

// d carried / d leg, p x p: D of C_j(image) D = s C_i(pose). NaN where the image has an angle that
// means nothing, such as the azimuth of a point on Z.
RowMatrix carried_derivatives(const ChainInfo& chain, const Leg& leg, const SymmetryPair& pair,
                              const Leg& like);

}  // namespace symkin
