// SPDX-License-Identifier: MIT
#include "symkin/symmetry/pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// Guides along x, y and z, in the translating layout of [P]US.
Mechanism orthoglide() {
  std::vector<Leg> legs;
  for (const auto& [radius, azimuth, height, guide, elevation] : std::vector<std::array<double, 5>>{
           {0.5, kPi, 0, 0, 0}, {0.5, -kPi / 2, 0, kPi / 2, 0}, {0, 0, -0.5, 0, kPi / 2}}) {
    Vector parameters(9);
    parameters << 0.31, radius, azimuth, height, guide, elevation, 0, 1, 0;
    legs.push_back({parameters, -1});
  }
  return {"orthoglide", leg_model("[P]US", Platform::translating), legs};
}

Index keeping_modes(const PairSymmetry& found) {
  return std::count_if(found.pairs.begin(), found.pairs.end(),
                       [](const FoundPair& each) { return each.keeps_modes; });
}

TEST(Pairs, FindTheSymmetryOfAnOrthoglideAboutItsDiagonal) {
  const Mechanism mechanism = orthoglide();
  const PairSymmetry found = find_pairs(mechanism, Vector::Zero(3));
  EXPECT_EQ(found.pairs.size(), 48U);
  EXPECT_EQ(keeping_modes(found), 6);
  EXPECT_TRUE(found.pairs.front().pair.is_identity() ||
              apart(found.pairs.front().pair, SymmetryPair{}, 1) < 1e-15);
}

TEST(Pairs, AreTheGroupOfTheHexapodAndItsPassageThroughTheBase) {
  Vector home = identity_pose(PoseSpace::spatial);
  home[2] = 0.7;
  const Mechanism mechanism = testing::hexapod();
  const PairSymmetry found = find_pairs(mechanism, home);
  EXPECT_EQ(found.pairs.size(), 12U);
  const SymmetryGroup group = SymmetryGroup::named("D3", 210 * kPi / 180);
  for (const SymmetryElement element : group.elements()) {
    const SymmetryPair pair = pair_of(group, element);
    EXPECT_TRUE(std::any_of(found.pairs.begin(), found.pairs.end(), [&](const FoundPair& each) {
      return apart(each.pair, pair, 1) < 1e-12;
    })) << SymmetryGroup::label(element);
  }
}

TEST(Pairs, FollowEachOtherAsTheyAreComposed) {
  const Mechanism mechanism = testing::hexapod();
  Vector home = identity_pose(PoseSpace::spatial);
  home.head<3>() << 0.1, -0.05, 0.7;
  const PairSymmetry found = find_pairs(mechanism, home);
  const auto act = [&](const SymmetryPair& pair, const RowMatrix& poses) {
    return transform_poses(pair, PoseSpace::spatial, poses);
  };
  for (const FoundPair& a : found.pairs) {
    for (const FoundPair& b : found.pairs) {
      const RowMatrix once = act(compose(a.pair, b.pair), home.transpose());
      const RowMatrix twice = act(a.pair, act(b.pair, home.transpose()));
      EXPECT_LT((once - twice).leftCols(3).cwiseAbs().maxCoeff(), 1e-14);
    }
    EXPECT_LT(apart(compose(inverse(a.pair), a.pair), SymmetryPair{}, 1), 1e-14);
  }
}

}  // namespace
}  // namespace symkin
