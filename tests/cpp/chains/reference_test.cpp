// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "chains/every_chain.hpp"
#include "chains/reference_numbers.hpp"

namespace symkin::testing {
namespace {

constexpr double kAccuracy = 1e-9;

auto find_case(const std::string& chain) {
  return std::find_if(reference::cases.begin(), reference::cases.end(),
                      [&](const auto& entry) { return entry.chain == chain; });
}

bool has_reference_numbers(const Chain& chain) {
  return is_rigid(chain) && find_case(chain.name) != reference::cases.end();
}

class ReferenceNumbers : public EveryChain {
 protected:
  const reference::Case& numbers() const { return *find_case(GetParam().name); }

  State state(double reading) const {
    const auto& [x, y, phi] = numbers().pose;
    State result{Eigen::Map<const Vector>(numbers().parameters.data(),
                                          static_cast<Index>(numbers().parameters.size())),
                 RowMatrix(1, 3), 1, reading};
    result.pose << x, y, phi;
    return result;
  }

  // How far apart two readings are; angles by the shortest turn.
  double distance(double a, double b) const {
    const double gap = gain(state(0)) * (a - b);
    return std::abs((is_angle(info().active_joint) ? wrap_angle(gap) : gap) / gain(state(0)));
  }
};

void expect_close(double value, double expected) {
  EXPECT_NEAR(value, expected, kAccuracy * std::max(1.0, std::abs(expected)));
}

TEST_P(ReferenceNumbers, NameTheParametersInTheSameOrder) {
  ASSERT_EQ(info().parameters.size(), numbers().parameter_names.size());
  for (std::size_t i = 0; i < info().parameters.size(); ++i) {
    EXPECT_EQ(info().parameters[i].name, numbers().parameter_names[i]);
  }
}

TEST_P(ReferenceNumbers, AgreeWithTheReadingOfOneWorkingModeEach) {
  const std::vector<int> all = modes();
  ASSERT_EQ(all.size(), numbers().readings.size());
  for (const auto& expected : numbers().readings) {
    const auto matching = std::count_if(all.begin(), all.end(), [&](int mode) {
      return distance(reading(state(0), mode), expected.psi) < kAccuracy;
    });
    EXPECT_EQ(matching, 1) << "psi " << expected.psi;
  }
}

TEST_P(ReferenceNumbers, AgreeWithTheClosureOffItsRoots) {
  expect_close(closure(state(0.5)), numbers().closure_at_half);
}

TEST_P(ReferenceNumbers, AgreeWithTheDerivativesOfTheReading) {
  for (const auto& expected : numbers().readings) {
    const ClosureRows rows = linearise(state(expected.psi));
    EXPECT_NEAR(rows.closure[0], 0, 1e-12);
    for (Index i = 0; i < model().parameter_count(); ++i) {
      expect_close(-rows.by_parameters(0, i) / rows.by_reading[0],
                   expected.by_parameters[static_cast<std::size_t>(i)]);
    }
    for (Index i = 0; i < 3; ++i) {
      expect_close(-rows.by_pose(0, i) / rows.by_reading[0],
                   expected.by_pose[static_cast<std::size_t>(i)]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, ReferenceNumbers,
                         ::testing::ValuesIn(chains_where(has_reference_numbers)), test_name);

TEST(ReferenceNumbersOfThePlanarChains, AreAllUsed) {
  EXPECT_EQ(reference::cases.size(), 18U);
  EXPECT_EQ(chains_where(has_reference_numbers).size(), reference::cases.size());
}

}  // namespace
}  // namespace symkin::testing
