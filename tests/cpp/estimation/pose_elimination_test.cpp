// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pose_elimination.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "symkin/support/dense.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Index kDof = 2;

// Rows of poses of two freedoms: three closures each, the first of them exact, and pairs.
struct Coupled {
  RowMatrix by_pose;
  Vector variances;
};

Coupled coupled(Index poses, const std::vector<std::pair<Index, Index>>& pairs,
                std::uint64_t seed) {
  Random random(seed);
  const auto value = [&] { return random.normal(); };
  const Index own = 3 * poses;
  Coupled made{RowMatrix::Zero(own + static_cast<Index>(pairs.size()), kDof * poses),
               Vector::Ones(own + static_cast<Index>(pairs.size()))};
  for (Index row = 0; row < own; ++row) {
    made.by_pose.block(row, row / 3 * kDof, 1, kDof) = RowMatrix::NullaryExpr(1, kDof, value);
    made.variances[row] = row % 3 == 0 ? 0 : 0.5 + random.uniform();
  }
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (const Index pose : {pairs[k].first, pairs[k].second}) {
      made.by_pose.block(own + static_cast<Index>(k), pose * kDof, 1, kDof) =
          RowMatrix::NullaryExpr(1, kDof, value);
    }
  }
  return made;
}

void expect_same(const Coupled& of, const std::vector<Index>& hubs) {
  const PoseElimination all = eliminate_pose(of.by_pose, of.variances, 0);
  const PoseElimination parts = eliminate_poses(of.by_pose, of.variances, kDof, hubs, 0);
  ASSERT_EQ(parts.conditions.cols(), all.conditions.cols());
  // What any residual leaves, and where that has the poses.
  const RowMatrix together = product(all.conditions, all.conditions.transpose());
  const RowMatrix apart = product(parts.conditions, parts.conditions.transpose());
  EXPECT_LT((apart - together).cwiseAbs().maxCoeff(), 1e-10 * together.cwiseAbs().maxCoeff());
  RowMatrix taken = -(of.variances.asDiagonal() * together);
  taken.diagonal().array() += 1;
  const RowMatrix there = product(all.solution, taken), here = product(parts.solution, taken);
  EXPECT_LT((here - there).cwiseAbs().maxCoeff(), 1e-10 * there.cwiseAbs().maxCoeff());
}

TEST(PoseElimination, OfAHubPieceByPieceIsThatOfAllTogether) {
  std::vector<std::pair<Index, Index>> star, two;
  for (Index pose = 1; pose < 12; ++pose) {
    star.emplace_back(0, pose);
  }
  expect_same(coupled(12, star, 1), {0});
  // Two hubs that share a piece of three poses, and have others of their own.
  two = {{0, 2}, {0, 3}, {0, 4}, {1, 4}, {1, 5}, {1, 6}, {4, 7}, {7, 8}, {0, 1}};
  expect_same(coupled(9, two, 2), {0, 1});
  expect_same(coupled(9, two, 3), {});
}

TEST(PoseElimination, OfAHubThatNoRowShowsInFullLeavesAsManyConditions) {
  std::vector<std::pair<Index, Index>> star;
  for (Index pose = 1; pose < 8; ++pose) {
    star.emplace_back(0, pose);
  }
  Coupled of = coupled(8, star, 4);
  of.by_pose.col(1).setZero();  // a freedom of the hub
  of.variances.head(3).setOnes();
  expect_same(of, {0});
}

}  // namespace
}  // namespace symkin
