// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

using Eigen::RowVector2d;

RowVector2d along(double angle) { return {std::cos(angle), std::sin(angle)}; }
RowVector2d across(double angle) { return {-std::sin(angle), std::cos(angle)}; }

// What the roles say: how a leg is described from another origin of the base or the platform.
class Translation : public EveryChain {
 protected:
  bool is_at_the_base() const { return GetParam().name.front() == '['; }
  bool is_at_the_platform() const { return GetParam().name.back() == ']'; }

  // One end of the leg, moved by `shift` in the coordinates of its own frame.
  void shift_end(Vector& parameters, End end, std::string_view radius_name,
                 std::string_view angle_name, bool active, const RowVector2d& shift) const {
    double& angle = parameters[*find_parameter(angle_name)];
    double& offset = parameters[*find_parameter("sensor_offset")];
    if (!find_parameter(radius_name)) {
      offset += shift.dot(along(angle));
      return;
    }
    double& radius = parameters[*find_parameter(radius_name)];
    if (has(end, ParameterKind::direction_distance)) {
      radius += shift.dot(along(angle));
      offset += active ? shift.dot(across(angle)) : 0;
      return;
    }
    const RowVector2d point = radius * along(angle) + shift;
    radius = point.norm();
    angle = std::atan2(point.y(), point.x());
  }
};

TEST_P(Translation, OfTheBasesOriginLeavesTheClosure) {
  for (const State& state : random_states()) {
    const RowVector2d shift(0.4, -0.7);
    State moved = state;
    moved.pose.leftCols<2>() += shift;
    shift_end(moved.parameters, End::base, "base_radius", "base_angle", is_at_the_base(), shift);
    EXPECT_NEAR(closure(moved), closure(state), 1e-12);
  }
}

using TranslationOnAPlatform = Translation;

TEST_P(TranslationOnAPlatform, OfItsOriginLeavesTheClosure) {
  for (const State& state : random_states()) {
    const RowVector2d shift(0.4, -0.7);
    const double phi = state.pose(0, 2);
    State moved = state;
    moved.pose.leftCols<2>() -= shift.x() * along(phi) + shift.y() * across(phi);
    shift_end(moved.parameters, End::platform, "platform_radius", "platform_angle",
              is_at_the_platform(), shift);
    EXPECT_NEAR(closure(moved), closure(state), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, Translation, ::testing::ValuesIn(every_chain()), test_name);
INSTANTIATE_TEST_SUITE_P(Chains, TranslationOnAPlatform,
                         ::testing::ValuesIn(chains_where(is_rigid)), test_name);

}  // namespace
}  // namespace symkin::testing
