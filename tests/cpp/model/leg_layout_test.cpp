// SPDX-License-Identifier: MIT
#include "symkin/model/leg_layout.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/mixed_mechanisms.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

std::string refusal(const std::vector<const ChainModel*>& chains) {
  try {
    in_one_layout(chains);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return {};
}

TEST(LegLayout, NamesEveryParameterOnceAndTheSensorsLast) {
  const LegModels models = in_one_layout({&leg_model("[P]RR"), &leg_model("[R]RR")});
  const std::vector<std::string> names{"distal_length",   "base_radius",    "base_angle",
                                       "platform_radius", "platform_angle", "proximal_length",
                                       "sensor_gain",     "sensor_offset"};
  for (const auto& model : models) {
    ASSERT_EQ(model->info().parameters.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      EXPECT_EQ(model->info().parameters[i].name, names[i]);
    }
  }
}

TEST(LegLayout, SaysOfEachLegWhatAParameterIsToIt) {
  const Mechanism mechanism = testing::cranks_and_slider().mechanism;
  EXPECT_TRUE(mechanism.mixed());
  const auto role = [&](Index leg, std::size_t i) {
    return mechanism.model(leg).info().parameters[i].role;
  };
  EXPECT_EQ(role(0, 0).kind, ParameterKind::length);
  EXPECT_EQ(role(2, 0).kind, ParameterKind::absent);
  EXPECT_EQ(role(0, 2).kind, ParameterKind::radius);
  EXPECT_EQ(role(2, 2).kind, ParameterKind::direction_distance);
  EXPECT_TRUE(mechanism.of_one_chain(0, 1));
  EXPECT_FALSE(mechanism.of_one_chain(0, 2));
  EXPECT_EQ(mechanism.estimated_parameters(2), (std::vector<Index>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(mechanism.first_estimated(3), 8 + 8 + 7);
}

TEST(LegLayout, KeepsNoValueWhereALegHasNoParameter) {
  const Mechanism mechanism = testing::cranks_and_slider().mechanism;
  RowMatrix parameters = mechanism.parameters();
  EXPECT_EQ(parameters(2, 0), 0);
  for (const double value : {-3.0, std::numeric_limits<double>::quiet_NaN()}) {
    parameters(2, 0) = value;
    EXPECT_EQ(mechanism.with_parameters(parameters).parameters(), mechanism.parameters());
  }
}

TEST(LegLayout, OfOneChainIsTheChainItself) {
  const Mechanism alike = testing::paper_3rrr();
  const std::vector<const ChainModel*> chains(3, alike.chain());
  const Mechanism listed("listed", chains, alike.legs());
  EXPECT_FALSE(listed.mixed());
  EXPECT_EQ(&listed.model(2), alike.chain());
}

TEST(LegLayout, RefusesLegsThatCannotCarryOnePlatform) {
  const std::string spaces = refusal({&leg_model("[R]RR"), &leg_model("U[P]S")});
  EXPECT_NE(spaces.find("a planar and a spatial one"), std::string::npos) << spaces;
  const std::string planes = refusal({&leg_model("U[P]S"), &leg_model("R[P]S")});
  EXPECT_NE(planes.find("\"R[P]S\" bind it to planes"), std::string::npos) << planes;
  const Mechanism three = testing::paper_3rrr();
  EXPECT_THROW(Mechanism("short", {three.chain(), &leg_model("[P]RR")}, three.legs()),
               InvalidInput);
  EXPECT_THROW(Mechanism("none", std::vector<const ChainModel*>(), {}), InvalidInput);
  const Mechanism mixed = testing::cranks_and_slider().mechanism;
  std::vector<Leg> four = mixed.legs();
  four.push_back(four.front());
  EXPECT_THROW(mixed.with_legs(four), InvalidInput);
  EXPECT_THROW(mixed.model(3), InvalidInput);
}

TEST(LegLayout, NamesTheChainOfAnImpossibleLeg) {
  const Mechanism mixed = testing::cranks_and_slider().mechanism;
  RowMatrix parameters = mixed.parameters();
  parameters(2, 1) = -1;
  try {
    mixed.with_parameters(parameters);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("leg 3 of chain [P]RR: distal_length"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace symkin
