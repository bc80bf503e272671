// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <string>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

using Eigen::RowVector2d;

class Drawing : public EveryChain {
 protected:
  static RowVector2d polar(double radius, double angle) {
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }

  RowVector2d base_point(const State& state) const {
    return polar(parameter(state, "base_radius"), parameter(state, "base_angle"));
  }
  RowVector2d platform_point(const State& state) const {
    const double phi = state.pose.cols() == 3 ? state.pose(0, 2) : 0;
    return state.pose.leftCols<2>() +
           polar(parameter(state, "platform_radius"), phi + parameter(state, "platform_angle"));
  }
};

TEST_P(Drawing, LeadsFromTheBasePointOrGuideToThePlatformPointOrGuide) {
  for (const State& state : random_states(20)) {
    const RowMatrix joints = joint_centres(state);
    ASSERT_EQ(joints.rows(), 3);
    ASSERT_EQ(joints.cols(), 2);
    if (find_parameter("base_radius")) {
      EXPECT_TRUE(joints.row(0).isApprox(base_point(state), 1e-12));
    }
    if (GetParam().platform == Platform::point || find_parameter("platform_radius")) {
      EXPECT_TRUE(joints.row(2).isApprox(platform_point(state), 1e-12));
    }
  }
}

// The two segments have these lengths when the reading closes the leg ("q": the active joint).
TEST_P(Drawing, HasTheLengthsOfTheLeg) {
  const std::map<std::string, std::array<std::string, 2>> segments{
      {"[R]RR", {"proximal_length", "distal_length"}},
      {"R[R]R", {"proximal_length", "distal_length"}},
      {"RR[R]", {"distal_length", "proximal_length"}},
      {"[R]PR", {"guide_offset", ""}},
      {"RP[R]", {"", "guide_offset"}},
      {"[P]RR", {"q", "distal_length"}},
      {"P[R]R", {"", "distal_length"}},
      {"PR[R]", {"", "distal_length"}},
      {"[R]RP", {"proximal_length", ""}},
      {"R[R]P", {"proximal_length", ""}},
      {"RR[P]", {"distal_length", "q"}},
      {"[P]RP", {"q", ""}},
      {"PR[P]", {"", "q"}},
      {"[P]PR", {"q", ""}},
      {"P[P]R", {"q", ""}},
      {"R[P]P", {"", "q"}},
      {"RP[P]", {"", "q"}},
      {"R[P]R", {"", ""}}};
  const auto expected = segments.find(GetParam().name);
  if (expected == segments.end()) {
    GTEST_SKIP() << "lengths not listed";
  }
  for (const State& state : random_states(20)) {
    const RowMatrix joints = joint_centres(state);
    for (Index i = 0; i < 2; ++i) {
      const std::string& name = expected->second[static_cast<std::size_t>(i)];
      if (!name.empty()) {
        const double length = name == "q" ? active_joint(state) : parameter(state, name);
        EXPECT_NEAR((joints.row(i + 1) - joints.row(i)).norm(), std::abs(length), 1e-11);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, Drawing, ::testing::ValuesIn(every_chain()), test_name);

}  // namespace
}  // namespace symkin::testing
