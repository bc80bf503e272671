// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

using Reach = EveryChain;
using LimitedReach = EveryChain;

TEST_P(Reach, EndsExactlyWhereTheReadingIsMissing) {
  Random random(2);
  int outside = 0;
  for (int i = 0; i < 10 * kStates; ++i) {
    const State state{random_parameters(random), random_pose(random, 4), 1, 0};
    for (const int mode : modes()) {
      ASSERT_EQ(std::isnan(reading(state, mode)), margin(state) < 0);
    }
    outside += margin(state) < 0 ? 1 : 0;
  }
  EXPECT_EQ(outside > 0, has_two_roots(GetParam()));
}

TEST_P(LimitedReach, EndsOneMarginAwayAndNoEarlier) {
  constexpr int kDirections = 256;
  Random random(3);
  for (int i = 0; i < kStates; ++i) {
    const State state{random_parameters(random), random_pose(random, 4), 1, 0};
    const double distance = std::abs(margin(state));
    const bool inside = margin(state) > 0;
    int crossed = 0;
    for (int k = 0; k < kDirections; ++k) {
      const double azimuth = 2 * M_PI * k / kDirections;
      EXPECT_EQ(margin(translated(state, 0.999 * distance, azimuth)) > 0, inside);
      crossed += (margin(translated(state, 1.01 * distance, azimuth)) > 0) != inside ? 1 : 0;
    }
    EXPECT_GT(crossed, 0) << "margin " << margin(state);
  }
}

TEST_P(LimitedReach, ShrinksNoFasterThanThePlatformMoves) {
  Random random(4);
  for (int i = 0; i < kStates; ++i) {
    const State state{random_parameters(random), random_pose(random, 4), 1, 0};
    const double distance = random.uniform();
    const State moved = translated(state, distance, 6 * random.uniform());
    EXPECT_LE(std::abs(margin(moved) - margin(state)), distance + 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, Reach, ::testing::ValuesIn(every_chain()), test_name);
INSTANTIATE_TEST_SUITE_P(Chains, LimitedReach, ::testing::ValuesIn(chains_where(has_two_roots)),
                         test_name);

}  // namespace
}  // namespace symkin::testing
