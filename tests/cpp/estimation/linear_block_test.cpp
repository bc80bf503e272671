// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/linear_block.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "symkin/estimation/detail/pair_rows.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Index kDof = 2, kUnknowns = 3;
constexpr double kDigits = 1e-10;

// Rows of poses of two freedoms: three closures each, the first of them exact, and pairs.
LinearPose coupled(Index poses, const std::vector<PoseBlocks::Pair>& pairs, std::uint64_t seed) {
  Random random(seed);
  const auto value = [&] { return random.normal(); };
  const Index own = 3 * poses, rows = own + static_cast<Index>(pairs.size());
  LinearPose made;
  made.misfit = Vector::NullaryExpr(rows, value);
  made.variances.setOnes(rows);
  made.by_pose.setZero(rows, kDof * poses);
  made.by_unknowns = RowMatrix::NullaryExpr(rows, kUnknowns, value);
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

std::vector<Index> columns_of(const std::vector<Index>& poses) {
  std::vector<Index> columns;
  for (const Index pose : poses) {
    for (Index i = 0; i < kDof; ++i) {
      columns.push_back(pose * kDof + i);
    }
  }
  return columns;
}

// What the observations' partners part, and the rows of each part.
struct Parted {
  PoseBlocks::Block block;
  std::vector<std::vector<Index>> rows;  // of each piece, and of the hubs
};

Parted parted(Index poses, const std::vector<PoseBlocks::Pair>& pairs) {
  Observations observations;
  std::vector<Index> named(static_cast<std::size_t>(poses), 0);
  observations.partners.setConstant(poses, poses, -1);
  observations.rises.values.setZero(poses, poses);
  std::vector<PoseBlocks::Pair> places;
  for (const auto& [other, pose] : pairs) {
    Index& k = named[static_cast<std::size_t>(pose)];
    observations.partners(pose, k) = static_cast<double>(other);
    places.emplace_back(pose, k++);
  }
  const PoseBlocks blocks(observations, std::vector<bool>(static_cast<std::size_t>(poses), false));
  Parted made{blocks.of(0), {}};
  std::vector<PoseBlocks::Piece> pieces = made.block.pieces;
  pieces.push_back(made.block.hubs);
  for (const PoseBlocks::Piece& piece : pieces) {
    std::vector<Index>& rows = made.rows.emplace_back();
    for (const Index pose : piece.poses) {
      rows.insert(rows.end(), {3 * pose, 3 * pose + 1, 3 * pose + 2});
    }
    for (const PoseBlocks::Pair& pair : piece.pairs) {
      const auto at = std::find(places.begin(), places.end(), pair);
      rows.push_back(3 * poses + (at - places.begin()));
    }
  }
  return made;
}

LinearBlock apart(const LinearPose& all, const Parted& parts) {
  const std::vector<Index>& hubs = parts.block.hubs.poses;
  std::vector<LinearPiece> pieces;
  for (std::size_t k = 0; k < parts.rows.size(); ++k) {
    const bool hub = k == parts.block.pieces.size();
    const std::vector<Index>& rows = parts.rows[k];
    LinearPiece piece{hub ? hubs : parts.block.pieces[k].poses, {}, {}};
    piece.rows.misfit = all.misfit(rows);
    piece.rows.variances = all.variances(rows);
    piece.rows.by_pose = all.by_pose(rows, columns_of(piece.poses));
    piece.rows.by_unknowns = all.by_unknowns(rows, kAll);
    piece.by_hubs = all.by_pose(rows, columns_of(hub ? std::vector<Index>{} : hubs));
    pieces.push_back(std::move(piece));
  }
  LinearPiece last = std::move(pieces.back());
  pieces.pop_back();
  return {std::move(pieces), std::move(last)};
}

void expect_near(const RowMatrix& here, const RowMatrix& there) {
  ASSERT_EQ(here.rows(), there.rows());
  EXPECT_LT((here - there).cwiseAbs().maxCoeff(), kDigits * (1 + there.cwiseAbs().maxCoeff()));
}

void expect_same(LinearPose all, Index poses, const std::vector<PoseBlocks::Pair>& pairs,
                 std::size_t hubs, std::size_t pieces) {
  const Parted parts = parted(poses, pairs);
  EXPECT_EQ(parts.block.hubs.poses.size(), hubs);
  EXPECT_EQ(parts.block.pieces.size(), pieces);
  const LinearBlock block = apart(all, parts);
  all.eliminate(0);
  ASSERT_EQ(block.conditions().size(), all.count());
  EXPECT_NEAR(block.conditions().squaredNorm(), all.conditions.squaredNorm(), kDigits);
  expect_near(product(block.jacobian().transpose(), block.jacobian()),
              product(all.jacobian.transpose(), all.jacobian));
  expect_near(block.jacobian().transpose() * block.conditions(),
              all.jacobian.transpose() * all.conditions);

  const Vector d = Vector::LinSpaced(kUnknowns, -0.3, 0.4);
  const RowMatrix& g = all.elimination.conditions;
  const Vector errors = -all.variances.cwiseProduct(g * (all.conditions + all.jacobian * d));
  const Vector tangents = all.elimination.solution * -(all.misfit + all.by_unknowns * d + errors);
  const RowMatrix covariance = Vector::LinSpaced(kUnknowns, 0.01, 0.03).asDiagonal();
  const RowMatrix by_unknowns = product(g, all.jacobian);
  const Vector explained =
      product(by_unknowns, covariance).cwiseProduct(by_unknowns).rowwise().sum();
  const std::vector<LinearBlock::Move> moves = block.moves(d);
  const std::vector<RowShares> shares = block.shares(covariance);
  for (std::size_t k = 0; k < moves.size(); ++k) {
    const std::vector<Index>& rows = parts.rows[k];
    if (rows.empty()) {
      continue;
    }
    expect_near(moves[k].errors, errors(rows));
    expect_near(moves[k].tangents, tangents(columns_of(block.pieces()[k].poses)));
    expect_near(shares[k].multipliers, (g * all.conditions)(rows));
    expect_near(shares[k].variances, Vector(g.rowwise().squaredNorm())(rows));
    expect_near(shares[k].explained, explained(rows));
  }
}

TEST(LinearBlock, OfAHubPieceByPieceIsThatOfAllTogether) {
  std::vector<PoseBlocks::Pair> star;
  for (Index pose = 1; pose < 12; ++pose) {
    star.emplace_back(0, pose);
  }
  expect_same(coupled(12, star, 1), 12, star, 1, 11);
  // Two hubs that share a piece of three poses, and have others of their own.
  const std::vector<PoseBlocks::Pair> two = {{0, 2}, {0, 3}, {0, 4}, {0, 1}, {0, 5},  {1, 4},
                                             {1, 6}, {8, 1}, {1, 9}, {4, 7}, {7, 10}, {3, 0}};
  expect_same(coupled(11, two, 2), 11, two, 2, 7);
  const std::vector<PoseBlocks::Pair> chain = {{0, 1}, {1, 2}, {0, 3}};
  expect_same(coupled(4, chain, 3), 4, chain, 0, 1);
}

TEST(LinearBlock, OfAHubThatNoRowShowsInFullLeavesAsManyConditions) {
  std::vector<PoseBlocks::Pair> star;
  for (Index pose = 1; pose < 8; ++pose) {
    star.emplace_back(0, pose);
  }
  LinearPose of = coupled(8, star, 4);
  of.by_pose.col(1).setZero();  // a freedom of the hub
  of.variances.head(3).setOnes();
  expect_same(of, 8, star, 1, 7);
}

}  // namespace
}  // namespace symkin
