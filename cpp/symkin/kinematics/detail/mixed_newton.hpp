// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/mechanism.hpp"

namespace symkin {

// ChainModel::forward_kinematics of a mechanism whose legs are of different chains: the same
// method, a pose at a time, on what the models of the legs say one by one.
void mixed_forward_kinematics(const Mechanism& mechanism, const RowMatrix& readings,
                              ConstRows start, const ForwardKinematicsOptions& options,
                              RowMatrix& poses, std::vector<ForwardStatus>& status);

}  // namespace symkin
