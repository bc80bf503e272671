// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/factors.hpp"

namespace symkin::factors {
namespace {

Vec3<Scalar> variable_position(const Eigen::Vector3d& position, int first) {
  return {Scalar(position[0], first), Scalar(position[1], first + 1),
          Scalar(position[2], first + 2)};
}

// exp([w]) R = R + [w] R to first order, at w = 0.
Mat3<Scalar> variable_rotation(const Eigen::Matrix3d& rotation, Index first) {
  Mat3<Scalar> variable;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    for (std::size_t column = 0; column < 3; ++column) {
      const auto element = [&](std::size_t row) {
        return rotation(static_cast<Index>(row), static_cast<Index>(column));
      };
      Scalar value(element(i));
      value.v[first + static_cast<Index>(j)] = element(k);
      value.v[first + static_cast<Index>(k)] = -element(j);
      variable[i][column] = value;
    }
  }
  return variable;
}

}  // namespace

Scene<Scalar> scene_of(const Frame& pose, const Frame& base, const Frame& target) {
  return {variable_position(pose.position, 0),    variable_rotation(pose.rotation, 3),
          variable_position(base.position, 6),    variable_rotation(base.rotation, 9),
          variable_position(target.position, 12), variable_rotation(target.rotation, 15)};
}

}  // namespace symkin::factors
