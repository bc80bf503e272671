// SPDX-License-Identifier: MIT
#include "symkin/support/random.hpp"

#include <gtest/gtest.h>
#include <random>

namespace symkin {
namespace {

TEST(Random, GivesTheNumbersOfTheStandardsMersenneTwister) {
  for (const std::uint64_t seed : {0ULL, 1ULL, 5489ULL, ~0ULL}) {
    MersenneTwister ours(seed);
    std::mt19937_64 standard(seed);
    for (int i = 0; i < 1000; ++i) {  // its state is renewed thrice
      ASSERT_EQ(ours(), standard()) << i;
    }
  }
}

TEST(Random, GivesOtherNumbersForEachStream) {
  EXPECT_NE(Random(1, 0).uniform(), Random(1, 1).uniform());
  EXPECT_EQ(Random(1, 2).uniform(), Random(1, 2).uniform());
}

}  // namespace
}  // namespace symkin
