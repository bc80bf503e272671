// SPDX-License-Identifier: MIT
#include "symkin/model/pose_manifold.hpp"

#include <ceres/product_manifold.h>

namespace symkin {

std::unique_ptr<ceres::Manifold> pose_manifold(PoseSpace space) {
  if (!has_quaternion(space)) {
    return nullptr;
  }
  // Both know a quaternion as (x, y, z, w).
  if (position_size(space) == 0) {
    return std::make_unique<ceres::EigenQuaternionManifold>();
  }
  return std::make_unique<
      ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::EigenQuaternionManifold>>();
}

}  // namespace symkin
