// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/manifold.h>

#include <memory>

#include "symkin/model/pose_space.hpp"

namespace symkin {

// For ceres::Problem::SetManifold of a pose: keeps its quaternion one of length one. Null where the
// coordinates are free as they are.
std::unique_ptr<ceres::Manifold> pose_manifold(PoseSpace space);

}  // namespace symkin
