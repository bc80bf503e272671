// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/linear_block.hpp"

#include <limits>
#include <utility>

namespace symkin {
namespace {

bool is_finite(const LinearPiece& piece) {
  return piece.rows.misfit.allFinite() && piece.rows.by_pose.allFinite() &&
         piece.by_hubs.allFinite();
}

}  // namespace

LinearBlock::LinearBlock(std::vector<LinearPiece> pieces, LinearPiece hubs)
    : pieces_(std::move(pieces)) {
  constexpr double kRank = 1e-9;
  const Index columns = pieces_.front().rows.by_unknowns.cols();
  const Index width = hubs.rows.by_pose.cols();
  bool finite = is_finite(hubs);
  for (const LinearPiece& piece : pieces_) {
    finite = finite && is_finite(piece);
  }
  if (!finite) {
    conditions_ = Vector::Constant(1, std::numeric_limits<double>::quiet_NaN());
    jacobian_ = RowMatrix::Zero(1, columns);
    return;
  }
  Index count = 0;
  for (LinearPiece& piece : pieces_) {
    piece.rows.eliminate(piece.poses.front());
    first_.push_back(count);
    count += piece.rows.count();
  }
  RowMatrix by_hubs(count, width), jacobian(count, columns), conditions(count, 1);
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const LinearPose& rows = pieces_[k].rows;
    by_hubs.middleRows(first_[k], rows.count()) =
        product(rows.elimination.conditions.transpose(), pieces_[k].by_hubs);
    jacobian.middleRows(first_[k], rows.count()) = rows.jacobian;
    conditions.middleRows(first_[k], rows.count()) = rows.conditions;
  }
  reflections_ = Reflections(by_hubs * inverse_column_lengths(by_hubs).asDiagonal(), kRank);
  const Index rank = reflections_.rank(), free = count - rank;
  reflections_.apply_transpose(by_hubs);
  reflections_.apply_transpose(jacobian);
  reflections_.apply_transpose(conditions);

  const LinearPose& own = hubs.rows;
  const Index m = own.misfit.size() + rank;
  centre_.misfit.resize(m);
  centre_.variances.setOnes(m);
  centre_.by_pose.resize(m, width);
  centre_.by_unknowns.resize(m, columns);
  centre_.misfit.head(m - rank) = own.misfit;
  centre_.variances.head(m - rank) = own.variances;
  centre_.by_pose.topRows(m - rank) = own.by_pose;
  centre_.by_unknowns.topRows(m - rank) = own.by_unknowns;
  centre_.misfit.tail(rank) = conditions.topRows(rank);
  centre_.by_pose.bottomRows(rank) = by_hubs.topRows(rank);
  centre_.by_unknowns.bottomRows(rank) = jacobian.topRows(rank);
  centre_.eliminate(hubs.poses.empty() ? pieces_.front().poses.front() : hubs.poses.front());

  conditions_.resize(free + centre_.count());
  jacobian_.resize(conditions_.size(), columns);
  conditions_.head(free) = conditions.bottomRows(free);
  jacobian_.topRows(free) = jacobian.bottomRows(free);
  conditions_.tail(centre_.count()) = centre_.conditions;
  jacobian_.bottomRows(centre_.count()) = centre_.jacobian;
  pieces_.push_back(std::move(hubs));
}

LinearBlock::Spread LinearBlock::spread(const RowMatrix& of_conditions) const {
  const Index rank = reflections_.rank(), more = centre_.count();
  const Index free = of_conditions.rows() - more;
  Spread all;
  all.centre = product(centre_.elimination.conditions, of_conditions.bottomRows(more));
  all.pieces.resize(rank + free, of_conditions.cols());
  all.pieces.topRows(rank) = all.centre.bottomRows(rank);
  all.pieces.bottomRows(free) = of_conditions.topRows(free);
  reflections_.apply(all.pieces);
  return all;
}

std::vector<LinearBlock::Move> LinearBlock::moves(const Vector& d) const {
  const Spread left = spread(conditions_ + jacobian_ * d);
  const Vector of_centre = -centre_.variances.cwiseProduct(Vector(left.centre));
  const Vector hubs =
      centre_.elimination.solution * -(centre_.misfit + centre_.by_unknowns * d + of_centre);
  std::vector<Move> all;
  for (std::size_t k = 0; k + 1 < pieces_.size(); ++k) {
    const LinearPose& rows = pieces_[k].rows;
    const RowMatrix of_piece = left.pieces.middleRows(first_[k], rows.count());
    Move move;
    move.errors =
        -rows.variances.cwiseProduct(Vector(product(rows.elimination.conditions, of_piece)));
    move.tangents = rows.elimination.solution *
                    -(rows.misfit + rows.by_unknowns * d + pieces_[k].by_hubs * hubs + move.errors);
    all.push_back(std::move(move));
  }
  all.push_back({of_centre.head(pieces_.back().rows.misfit.size()), hubs});
  return all;
}

// E = G B of a piece, B its rows of what spread() takes conditions to: B B' = 1 - Q_1 (1 - G_c
// G_c') Q_1', Q_1 the piece's rows of what the hubs are in and G_c those of the centre's G.
std::vector<RowShares> LinearBlock::shares(const RowMatrix& covariance) const {
  constexpr double kRounding = 1e-13;
  const Index rank = reflections_.rank();
  const Spread multipliers = spread(conditions_);
  const Spread by_unknowns = spread(jacobian_);
  const RowMatrix& of_centre = centre_.elimination.conditions;
  const RowMatrix kept = of_centre.bottomRows(rank);
  const RowMatrix gone = RowMatrix::Identity(rank, rank) - product(kept, kept.transpose());
  RowMatrix held = RowMatrix::Identity(multipliers.pieces.rows(), rank);
  reflections_.apply(held);
  const auto explained = [&](const RowMatrix& rows) {
    return Vector(product(rows, covariance).cwiseProduct(rows).rowwise().sum());
  };
  std::vector<RowShares> all;
  for (std::size_t k = 0; k + 1 < pieces_.size(); ++k) {
    const RowMatrix& g = pieces_[k].rows.elimination.conditions;
    const auto of_piece = [&](const RowMatrix& stacked) {
      return product(g, stacked.middleRows(first_[k], g.cols()));
    };
    const RowMatrix of_held = of_piece(held);
    const Vector most = g.rowwise().squaredNorm();
    const Vector less = product(of_held, gone).cwiseProduct(of_held).rowwise().sum();
    const Vector squares = ((most - less).array() > kRounding * most.array())
                               .select(most - less, Vector::Zero(most.size()));
    all.push_back({of_piece(multipliers.pieces), squares, explained(of_piece(by_unknowns.pieces))});
  }
  const Index own = pieces_.back().rows.misfit.size();
  all.push_back({multipliers.centre.topRows(own), of_centre.topRows(own).rowwise().squaredNorm(),
                 explained(by_unknowns.centre.topRows(own))});
  return all;
}

}  // namespace symkin
