// SPDX-License-Identifier: MIT
// The example of docs/adding-a-chain.md, taken from the page.
#include <gtest/gtest.h>

#include "symkin/chains/detail/models.hpp"
#include "symkin/chains/planar.hpp"
#include "symkin/chains/registry.hpp"

namespace symkin::page {

#include "adding_a_chain.hpp"

namespace {

TEST(AddingAChain, TheExampleOfThePageIsTheChainThatItSays) {
  const chains::Models models = chains::family_models<RprChains>(nullptr);
  ASSERT_EQ(models.size(), 2U);
  const Platform platforms[] = {Platform::rigid, Platform::point};
  for (std::size_t i = 0; i < 2; ++i) {
    const ChainModel& known = leg_model("R[P]R", platforms[i]);
    ASSERT_EQ(models[i]->parameter_count(), known.parameter_count());
    const Vector parameters = Vector::LinSpaced(known.parameter_count(), 0.4, 1.1);
    const RowMatrix poses = RowMatrix::Constant(1, i == 0 ? 3 : 2, 0.7);
    Vector readings(1);
    Vector expected(1);
    models[i]->inverse_kinematics(parameters, 1, poses, readings);
    known.inverse_kinematics(parameters, 1, poses, expected);
    EXPECT_EQ(readings[0], expected[0]);
    models[i]->closure(parameters, poses, readings, expected);
    EXPECT_NEAR(expected[0], 0, 1e-15);
  }
}

}  // namespace
}  // namespace symkin::page
