// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/model/chain_model.hpp"

namespace symkin {

// Legs that are asked one by one.
struct LegsOneByOne {
  std::vector<const LegModel*> models;
  std::vector<LegValues> values;
};

// ChainModel::forward_kinematics of legs of different chains, or of chains without kernels: the
// same method, a pose at a time, on what the models of the legs say one by one.
void forward_kinematics(const LegsOneByOne& legs, const RowMatrix& readings, ConstRows start,
                        const ForwardKinematicsOptions& options, RowMatrix& poses,
                        std::vector<ForwardStatus>& status);

}  // namespace symkin
