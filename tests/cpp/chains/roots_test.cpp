// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
Vector2d along(double angle) { return {std::cos(angle), std::sin(angle)}; }

using Roots = EveryChain;
using OneRoot = EveryChain;
using AngularRoots = EveryChain;

TEST_P(Roots, CloseTheLegInEveryWorkingMode) {
  for (State state : random_states()) {
    for (const int mode : modes()) {
      state.reading = reading(state, mode);
      EXPECT_NEAR(closure(state), 0, 1e-12);
    }
  }
}

TEST_P(OneRoot, IsTheSameInBothWorkingModes) {
  for (const State& state : random_states()) {
    EXPECT_EQ(reading(state, 1), reading(state, -1));
  }
}

TEST_P(AngularRoots, AreReadWithinHalfATurnOfTheSensorsZero) {
  for (const State& state : random_states()) {
    EXPECT_LE(std::abs(gain(state) * state.reading), M_PI);
  }
}

class TwoRoots : public EveryChain {
 protected:
  // The quantity whose sign the working mode is, from a drawing of the leg: turn of an elbow, lean
  // of a link along a guide (n . link = u x link), travel from a guide's foot.
  double orientation(const State& state) const {
    const RowMatrix joints = joint_centres(state);
    const Vector2d first = (joints.row(1) - joints.row(0)).transpose();
    const Vector2d second = (joints.row(2) - joints.row(1)).transpose();
    const double phi = state.pose.cols() == 3 ? state.pose(0, 2) : 0;
    const std::string& chain = GetParam().name;
    if (chain == "[R]PR") {
      return cross(along(active_joint(state)), second);
    }
    if (chain == "RP[R]") {
      return -cross(along(active_joint(state) + phi), first);
    }
    if (has(End::base, ParameterKind::direction_distance)) {
      return cross(along(parameter(state, "base_angle")), second);
    }
    if (has(End::platform, ParameterKind::direction_distance)) {
      return cross(along(parameter(state, "platform_angle") + phi), first);
    }
    return cross(first, second);
  }
};

TEST_P(TwoRoots, HaveTheOrientationThatTheWorkingModeStates) {
  for (State state : random_states()) {
    for (const int mode : modes()) {
      state.reading = reading(state, mode);
      EXPECT_GT(mode * orientation(state), 0) << "mode " << mode;
    }
  }
}

TEST_P(TwoRoots, LieOnTheBranchThatTheSlopeOfTheClosureTells) {
  const auto slope = [this](const State& state) {  // dh/dq
    return linearise(state).by_reading[0] / gain(state);
  };
  const std::vector<State> states = random_states();
  const double in_mode_plus = states[0].mode * slope(states[0]);
  for (const State& state : states) {
    EXPECT_GT(in_mode_plus * state.mode * slope(state), 0);
  }
}

bool has_angular_joint(const Chain& chain) { return is_angle(info_of(chain).active_joint); }

INSTANTIATE_TEST_SUITE_P(Chains, Roots, ::testing::ValuesIn(every_chain()), test_name);
INSTANTIATE_TEST_SUITE_P(Chains, OneRoot, ::testing::ValuesIn(chains_where(has_one_root)),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Chains, AngularRoots, ::testing::ValuesIn(chains_where(has_angular_joint)),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Chains, TwoRoots, ::testing::ValuesIn(chains_where(has_two_roots)),
                         test_name);

}  // namespace
}  // namespace symkin::testing
