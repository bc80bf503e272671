// SPDX-License-Identifier: MIT
#include "symkin/model/mechanism.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/mechanisms.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// The message of what building the changed 3-RRR throws; empty if nothing.
std::string refusal(const std::function<void(std::vector<Leg>&)>& change) {
  const Mechanism mechanism = testing::paper_3rrr();
  std::vector<Leg> legs = mechanism.legs();
  change(legs);
  try {
    const Mechanism changed("changed", *mechanism.chain(), legs);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return {};
}

bool names(const std::string& message, const std::string& words) {
  return message.find(words) != std::string::npos;
}

TEST(Mechanism, NamesLegAndParameterOfAnImpossibleValue) {
  const std::string negative = refusal([](auto& legs) { legs[1].parameters[1] = -0.5; });
  EXPECT_TRUE(names(negative, "leg 2") && names(negative, "distal_length")) << negative;
  const std::string none = refusal([](auto& legs) { legs[1].parameters[1] = 0; });
  EXPECT_TRUE(names(none, "leg 2") && names(none, "distal_length")) << none;
  const std::string gain = refusal([](auto& legs) { legs[2].parameters[6] = 0; });
  EXPECT_TRUE(names(gain, "leg 3") && names(gain, "sensor_gain")) << gain;
  const std::string nan = refusal([](auto& legs) { legs[0].parameters[3] = std::nan(""); });
  EXPECT_TRUE(names(nan, "leg 1") && names(nan, "base_angle")) << nan;
  EXPECT_TRUE(names(refusal([](auto& legs) { legs[0].working_mode = 0; }), "working_mode"));
}

TEST(Mechanism, RefusesFewerLegsThanDegreesOfFreedom) {
  EXPECT_TRUE(names(refusal([](auto& legs) { legs.pop_back(); }), "2 legs"));
}

TEST(Mechanism, TakesOtherParametersInTheSameOrder) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix moved = mechanism.parameters().array() + 0.01;
  EXPECT_EQ(mechanism.with_parameters(moved).parameters(), moved);
  EXPECT_THROW(mechanism.with_parameters(moved.topRows(2)), InvalidInput);
}

}  // namespace
}  // namespace symkin
