// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pose_elimination.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// Rows and columns of B that are in no other piece.
struct Piece {
  std::vector<Index> rows, columns;
};

// The pieces that the hubs leave of the poses; the first one is the hubs themselves, with the rows
// that are in no other pose.
std::vector<Piece> pieces_of(const RowMatrix& by_pose, Index dof, const std::vector<Index>& hubs) {
  const Index count = by_pose.cols() / dof;
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  std::vector<bool> is_hub(at(count), false);
  for (const Index hub : hubs) {
    is_hub[at(hub)] = true;
  }
  std::vector<Index> root(at(count));
  std::iota(root.begin(), root.end(), Index{0});
  const auto find = [&](Index pose) {
    while (root[at(pose)] != pose) {
      pose = root[at(pose)] = root[at(root[at(pose)])];
    }
    return pose;
  };
  std::vector<Index> any(at(by_pose.rows()), -1);  // a pose of each row that is no hub
  for (Index row = 0; row < by_pose.rows(); ++row) {
    for (Index pose = 0; pose < count; ++pose) {
      if (!is_hub[at(pose)] && !by_pose.row(row).segment(pose * dof, dof).isZero(0)) {
        if (any[at(row)] >= 0) {
          root[at(find(pose))] = find(any[at(row)]);
        }
        any[at(row)] = pose;
      }
    }
  }
  std::vector<Piece> pieces(1);
  std::vector<std::size_t> piece(at(count), 0);
  for (Index pose = 0; pose < count; ++pose) {
    if (!is_hub[at(pose)]) {
      std::size_t& own = piece[at(find(pose))];
      if (own == 0) {
        own = pieces.size();
        pieces.emplace_back();
      }
      piece[at(pose)] = own;
    }
    for (Index i = 0; i < dof; ++i) {
      pieces[piece[at(pose)]].columns.push_back(pose * dof + i);
    }
  }
  for (Index row = 0; row < by_pose.rows(); ++row) {
    pieces[any[at(row)] < 0 ? 0 : piece[at(any[at(row)])]].rows.push_back(row);
  }
  return pieces;
}

}  // namespace

PoseElimination eliminate_pose(const RowMatrix& by_pose, const Vector& variances, Index pose) {
  constexpr double kRank = 1e-9;
  constexpr double kRedundant = 1e-12;
  const Index m = by_pose.rows();
  // Rows of length one: ranks shall not depend on units.
  Vector scale(m);
  for (Index i = 0; i < m; ++i) {
    const double length = by_pose.row(i).norm();
    scale[i] = length > 0 ? 1 / length : 1;
  }
  const auto [onto, left] = pseudo_inverse(scale.asDiagonal() * by_pose, kRank);
  PoseElimination result;
  result.solution = onto * scale.asDiagonal();
  if (left.cols() == 0) {
    result.conditions.resize(m, 0);
    return result;
  }
  // Of the rows' own deviations: squaring them into a covariance would lose half of the digits.
  const Vector deviations = scale.cwiseProduct(variances.cwiseSqrt());
  const RowMatrix upper = triangular_factor(deviations.asDiagonal() * left);
  const Vector pivots = upper.diagonal().cwiseAbs();
  if (!(pivots.minCoeff() > kRedundant * pivots.maxCoeff())) {
    throw InvalidInput("pose " + std::to_string(pose + 1) +
                       ": more exact observations than the pose has degrees of freedom (more legs "
                       "than degrees of freedom, or a singular pose); declare a noise of the "
                       "readings above zero");
  }
  result.conditions =
      scale.asDiagonal() * lower_solution(upper.transpose(), left.transpose()).transpose();
  return result;
}

PoseElimination eliminate_poses(const RowMatrix& by_pose, const Vector& variances, Index dof,
                                const std::vector<Index>& hubs, Index pose) {
  constexpr double kRank = 1e-9;
  const std::vector<Piece> pieces = pieces_of(by_pose, dof, hubs);
  if (hubs.empty() || pieces.size() < 3) {
    return eliminate_pose(by_pose, variances, pose);
  }
  const Piece& hub = pieces.front();
  const auto width = static_cast<Index>(hub.columns.size());
  const auto own = static_cast<Index>(hub.rows.size());
  std::vector<PoseElimination> parts;
  Index left = 0;  // conditions of all pieces, which the hubs are still in
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const Piece& piece = pieces[k];
    parts.push_back(
        eliminate_pose(by_pose(piece.rows, piece.columns), variances(piece.rows), pose));
    left += parts.back().conditions.cols();
  }
  RowMatrix by_hub(left, width);
  for (std::size_t k = 1, row = 0; k < pieces.size(); ++k) {
    const RowMatrix& g = parts[k - 1].conditions;
    by_hub.middleRows(static_cast<Index>(row), g.cols()) =
        g.transpose() * by_pose(pieces[k].rows, hub.columns);
    row += static_cast<std::size_t>(g.cols());
  }
  // Orthogonal maps take these to as few rows as the hubs need and to others without them.
  const auto [onto, free] =
      pseudo_inverse(by_hub * inverse_column_lengths(by_hub).asDiagonal(), kRank);
  const Index rank = left - free.cols();
  const RowMatrix held = column_space(onto.transpose()).basis.leftCols(rank);
  RowMatrix of_hub(own + rank, width);
  of_hub << by_pose(hub.rows, hub.columns), held.transpose() * by_hub;
  Vector noise = Vector::Ones(own + rank);
  noise.head(own) = variances(hub.rows);
  const PoseElimination centre = eliminate_pose(of_hub, noise, pose);

  PoseElimination result;
  const Index more = centre.conditions.cols();
  RowMatrix back(left, free.cols() + more);  // from all conditions to those of the pieces
  back << free, held * centre.conditions.bottomRows(rank);
  result.conditions.setZero(by_pose.rows(), back.cols());
  result.conditions(hub.rows, Eigen::seqN(free.cols(), more)) = centre.conditions.topRows(own);
  RowMatrix of_centre(width, by_pose.rows());  // the hubs' tangents by all rows
  of_centre.setZero();
  of_centre(kAll, hub.rows) = centre.solution.leftCols(own);
  const RowMatrix across = centre.solution.rightCols(rank) * held.transpose();
  for (std::size_t k = 1, row = 0; k < pieces.size(); ++k) {
    const RowMatrix& g = parts[k - 1].conditions;
    const auto first = static_cast<Index>(row);
    result.conditions(pieces[k].rows, kAll) = g * back.middleRows(first, g.cols());
    of_centre(kAll, pieces[k].rows) = across.middleCols(first, g.cols()) * g.transpose();
    row += static_cast<std::size_t>(g.cols());
  }
  result.solution.setZero(by_pose.cols(), by_pose.rows());
  result.solution(hub.columns, kAll) = of_centre;
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const Piece& piece = pieces[k];
    const RowMatrix& a = parts[k - 1].solution;
    const RowMatrix by_centre = a * by_pose(piece.rows, hub.columns);
    result.solution(piece.columns, kAll) = -by_centre * of_centre;
    for (Index i = 0; i < a.rows(); ++i) {
      for (Index j = 0; j < a.cols(); ++j) {
        result.solution(piece.columns[static_cast<std::size_t>(i)],
                        piece.rows[static_cast<std::size_t>(j)]) += a(i, j);
      }
    }
  }
  return result;
}

}  // namespace symkin
