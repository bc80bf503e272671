// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

constexpr double kStep = 1e-5;
constexpr double kAccuracy = 1e-7;  // of central differences with that step

// Derivative of f where `value`, which f reads, is moved.
template <typename Function>
double central_difference(double& value, const Function& f) {
  const double middle = value;
  value = middle + kStep;
  const double above = f();
  value = middle - kStep;
  const double below = f();
  value = middle;
  return (above - below) / (2 * kStep);
}

class Derivatives : public EveryChain {
 protected:
  // Reading at the pose less a measured one.
  double difference(const State& state, double measured) const {
    Vector value(1);
    model().reading_differences(state.parameters, Vector::Constant(1, reading(state, state.mode)),
                                Vector::Constant(1, measured), value);
    return value[0];
  }
};

TEST_P(Derivatives, OfTheClosureMatchCentralDifferences) {
  for (State state : random_states()) {
    state.reading += 0.1;  // off the root too
    const ClosureRows rows = linearise(state);
    const auto h = [&] { return closure(state); };
    EXPECT_EQ(rows.closure[0], h());
    for (Index i = 0; i < state.parameters.size(); ++i) {
      EXPECT_NEAR(rows.by_parameters(0, i), central_difference(state.parameters[i], h), kAccuracy)
          << info().parameters[static_cast<std::size_t>(i)].name;
    }
    for (Index i = 0; i < state.pose.cols(); ++i) {
      EXPECT_NEAR(rows.by_pose(0, i), central_difference(state.pose(0, i), h), kAccuracy);
    }
    EXPECT_NEAR(rows.by_reading[0], central_difference(state.reading, h), kAccuracy);
  }
}

TEST_P(Derivatives, ByPoseAloneAreTheSame) {
  for (const State& state : random_states(20)) {
    const ClosureRows all = linearise(state);
    ClosureRows pose_only;
    model().linearise_pose(state.parameters, state.pose, Vector::Constant(1, state.reading),
                           pose_only);
    EXPECT_NEAR(pose_only.closure[0], all.closure[0], 1e-14);
    EXPECT_NEAR(pose_only.by_reading[0], all.by_reading[0], 1e-14);
    EXPECT_TRUE(pose_only.by_pose.isApprox(all.by_pose, 1e-13));
  }
}

TEST_P(Derivatives, OfTheReadingMatchCentralDifferencesOnEveryTurnOfTheSensor) {
  const bool turns = is_angle(info().active_joint);
  for (State state : random_states(20)) {
    for (const int turn : turns ? std::vector<int>{-1, 0, 2} : std::vector<int>{0}) {
      const double measured = state.reading - 0.01 + turn * 2 * M_PI / gain(state);
      EXPECT_NEAR(difference(state, measured), 0.01, 1e-12);
      State on_turn = state;
      on_turn.reading = measured + 0.01;
      const ClosureRows rows = linearise(on_turn);
      const Vector gradient = -rows.by_parameters.row(0).transpose() / rows.by_reading[0];
      for (Index i = 0; i < gradient.size(); ++i) {
        EXPECT_NEAR(
            gradient[i],
            central_difference(state.parameters[i], [&] { return difference(state, measured); }),
            kAccuracy * std::max(1.0, std::abs(gradient[i])))
            << info().parameters[static_cast<std::size_t>(i)].name;
      }
    }
  }
}

TEST_P(Derivatives, ByTheParametersHaveFullRankAtRandomPoses) {
  constexpr Index kPoses = 60;
  Random random(6);
  for (int leg = 0; leg < 10; ++leg) {
    const Vector parameters = random_parameters(random);
    RowMatrix jacobian(kPoses, model().parameter_count());
    for (Index row = 0; row < kPoses;) {
      if (const auto state = closed_state(parameters, random)) {
        const ClosureRows rows = linearise(*state);
        jacobian.row(row++) = rows.by_parameters.row(0) / rows.by_reading[0];
      }
    }
    const Vector scale = jacobian.colwise().norm();
    const Eigen::MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
    const Vector values = Eigen::JacobiSVD<Eigen::MatrixXd>(scaled).singularValues();
    EXPECT_GT(values.tail(1)[0] / values[0], 1e-4);
  }
}

using DerivativesBeyondReach = EveryChain;

TEST_P(DerivativesBeyondReach, AreThoseOfAClosureThatIsFiniteWhereNoReadingIs) {
  Random random(5);
  int outside = 0;
  while (outside < 20) {
    const State state{random_parameters(random), random_pose(random, 4), 1, 0};
    if (margin(state) < 0) {
      ++outside;
      EXPECT_TRUE(std::isnan(reading(state, state.mode)));
      const ClosureRows rows = linearise(state);
      EXPECT_TRUE(std::isfinite(rows.closure[0]));
      EXPECT_TRUE(rows.by_parameters.allFinite());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, Derivatives, ::testing::ValuesIn(every_chain()), test_name);
INSTANTIATE_TEST_SUITE_P(Chains, DerivativesBeyondReach,
                         ::testing::ValuesIn(chains_where(has_two_roots)), test_name);

}  // namespace
}  // namespace symkin::testing
