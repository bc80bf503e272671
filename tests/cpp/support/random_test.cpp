// SPDX-License-Identifier: MIT
#include "symkin/support/random.hpp"

#include <gtest/gtest.h>

namespace symkin {
namespace {

TEST(Random, GivesOtherNumbersForEachStream) {
  EXPECT_NE(Random(1, 0).uniform(), Random(1, 1).uniform());
  EXPECT_EQ(Random(1, 2).uniform(), Random(1, 2).uniform());
}

}  // namespace
}  // namespace symkin
