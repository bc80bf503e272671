// SPDX-License-Identifier: MIT
#include "symkin/chains/registry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

using Names = std::set<std::string>;

Names names(Platform platform) {
  const auto listed = chain_names(platform);
  return {listed.begin(), listed.end()};
}

std::string refusal(std::string_view chain, Platform platform = Platform::rigid) {
  try {
    leg_model(chain, platform);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "accepted";
}

void expect_part(const std::string& part, const std::string& message) {
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

bool includes(const Names& all, const Names& some) {
  return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

TEST(Registry, KnowsTheEighteenPlanarChainsAndTheHexapodsLeg) {
  EXPECT_TRUE(includes(
      names(Platform::rigid),
      {"[R]RR", "R[R]R", "RR[R]", "R[P]R", "[R]PR", "RP[R]", "[P]RR", "P[R]R", "PR[R]", "RR[P]",
       "R[R]P", "[R]RP", "[P]RP", "PR[P]", "[P]PR", "P[P]R", "R[P]P", "RP[P]", "U[P]S"}));
}

TEST(Registry, PutsAPointOnTheChainsThatKnowThePlatformByAPoint) {
  EXPECT_TRUE(includes(names(Platform::point),
                       {"[R]RR", "R[R]R", "R[P]R", "[R]PR", "[P]RR", "P[R]R", "[P]PR", "P[P]R"}));
}

TEST(Registry, KnowsTheChainsOfDeltasHexaAndHexaglide) {
  const Names spatial{"[P]US", "[R]US", "U[P]S", "U[P]S pulley"};
  EXPECT_EQ(names(Platform::translating), spatial);
  EXPECT_TRUE(includes(names(Platform::rigid), spatial));
  EXPECT_EQ(platform_named("translating"), Platform::translating);
}

TEST(Registry, KnowsTheChainsOfThreeLegsThatBindTheirPlatform) {
  for (const char* const name : {"R[P]S", "[P]RS"}) {
    EXPECT_EQ(leg_model(name).info().closures, 2);
    EXPECT_EQ(leg_model(name).info().pose_space, PoseSpace::spatial);
    expect_part("expected \"rigid\"", refusal(name, Platform::translating));
    expect_part("expected \"rigid\"", refusal(name, Platform::point));
  }
}

TEST(Registry, KnowsTheSphericalChain) {
  EXPECT_EQ(names(Platform::spherical), Names{"[R]RR"});
  EXPECT_EQ(platform_named("spherical"), Platform::spherical);
  EXPECT_EQ(leg_model("[R]RR", Platform::spherical).info().pose_space, PoseSpace::spherical);
}

TEST(Registry, RefusesAPlatformInAnotherSpaceThanTheChain) {
  expect_part("about one centre; expected \"[R]RR\"", refusal("[P]US", Platform::spherical));
  expect_part("moves in a plane", refusal("[R]RR", Platform::translating));
  expect_part("\"rigid\" or \"translating\"", refusal("[P]US", Platform::point));
}

TEST(Registry, GivesEachChainUnderItsOwnName) {
  for (const Platform platform :
       {Platform::rigid, Platform::point, Platform::translating, Platform::spherical}) {
    for (const std::string& name : chain_names(platform)) {
      EXPECT_EQ(leg_model(name, platform).info().name, name);
    }
  }
}

TEST(Registry, EndsTheParametersOfEveryChainWithTheSensors) {
  for (const Platform platform :
       {Platform::rigid, Platform::point, Platform::translating, Platform::spherical}) {
    for (const std::string& name : chain_names(platform)) {
      const auto& parameters = leg_model(name, platform).info().parameters;
      ASSERT_GE(parameters.size(), 3U);
      EXPECT_EQ(parameters.end()[-2].name, "sensor_gain");
      EXPECT_EQ(parameters.end()[-1].name, "sensor_offset");
    }
  }
}

TEST(Registry, GivesEveryEndOfEveryChainItsOwnRolesOnce) {
  for (const Platform platform :
       {Platform::rigid, Platform::point, Platform::translating, Platform::spherical}) {
    for (const std::string& name : chain_names(platform)) {
      const ChainInfo& info = leg_model(name, platform).info();
      for (std::size_t i = 0; i < info.parameters.size(); ++i) {
        const auto& [parameter, role, held] = info.parameters[i];
        const auto begins = [&](std::string_view with) {
          return parameter.substr(0, with.size()) == with;
        };
        const bool of_direction = begins("guide_") || begins("axis_");
        EXPECT_EQ(role.end == End::platform, begins("platform_")) << name << ' ' << parameter;
        EXPECT_EQ(role.end == End::base,
                  begins("base_") || (of_direction && parameter != "guide_offset"))
            << name << ' ' << parameter;
        if (role.kind != ParameterKind::length && role.kind != ParameterKind::arc) {
          EXPECT_EQ(info.find(role), i) << name << ' ' << parameter;
        }
      }
    }
  }
}

TEST(Registry, LeavesOutThePlatformsParametersOfAPoint) {
  for (const std::string& name : chain_names(Platform::point)) {
    const ChainInfo& info = leg_model(name, Platform::point).info();
    EXPECT_EQ(info.pose_space, PoseSpace::point);
    EXPECT_EQ(info.parameters.size() + 2, leg_model(name).info().parameters.size());
    for (const ParameterInfo& parameter : info.parameters) {
      EXPECT_EQ(parameter.name.find("platform"), std::string_view::npos) << parameter.name;
    }
  }
}

TEST(Registry, RefusesTwoPassivePrismaticJointsWithTheReason) {
  for (const auto* chain : {"P[R]P", "[R]PP", "PP[R]"}) {
    expect_part("two passive prismatic joints", refusal(chain));
    expect_part("orientation only", refusal(chain));
    expect_part("orientation only", refusal(chain, Platform::point));
  }
}

TEST(Registry, RefusesAPointPlatformOnChainsThatMeasureThePlatformsDirectionWithTheReason) {
  for (const auto* chain :
       {"RR[R]", "RP[R]", "PR[R]", "RR[P]", "R[R]P", "[R]RP", "[P]RP", "PR[P]", "R[P]P", "RP[P]"}) {
    expect_part("cannot carry a point platform", refusal(chain, Platform::point));
  }
}

TEST(Registry, NamesTheNearestChainForAnUnknownOne) {
  expect_part("\"[R]RR\"", refusal("[R]RRR"));
  expect_part("unknown chain \"R[P]U\"", refusal("R[P]U"));
}

}  // namespace
}  // namespace symkin
