// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "symkin/chains/declared/assembly.hpp"
#include "symkin/model/chain_model.hpp"

namespace symkin::declared {

// A declared leg as a chain: a name for messages, what it carries, and its branch.
struct Declaration {
  std::string name;
  PoseSpace pose_space;
  Description leg;
  Vector home_pose;         // a row of a pose array
  Vector home_joints;       // that stand by themselves
  std::vector<Index> free;  // coordinates that can be chosen where the legs bind the platform
  bool recognise = true;    // run as a known chain where it is one
  // Which of the leg's closures it is, if not all of them: the first of a leg with a joint that is
  // read, any of one without.
  int closure = -1;
};

// The parameters of a leg are its scalars, its handedness, and those of a linear sensor if it is
// read. Throws InvalidInput where the leg is not one that can be identified by one reading.
std::unique_ptr<const ChainModel> declared_model(const Declaration& declaration);

// The joints by themselves that close the drawn leg at a pose, near `start`; of those that are not
// `known` any value may be found. Throws InvalidInput where none is.
Vector joints_at_home(const Description& leg, const Pose& pose, ConstVector start,
                      const std::vector<bool>& known);

// The joints by themselves of a leg with such parameters, a row a pose; not numbers where it does
// not reach.
RowMatrix joints_at(const Declaration& declaration, ConstVector parameters, ConstRows poses);

// Which scalars show nothing that the sensors and other scalars do not show at full poses near
// home, in first order: lengths of links are kept first, then positions at the base, at the
// platform, and turns in the same order. True where a scalar is to be held. A leg with several
// sensors is declared once for each, with that joint alone read, and for each closure without a
// reading; throws InvalidInput without any.
std::vector<bool> redundant_scalars(const std::vector<Declaration>& readings);

Pose pose_of(PoseSpace space, const double* row);

}  // namespace symkin::declared
