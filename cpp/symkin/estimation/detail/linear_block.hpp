// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/latent_poses.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {

// Poses of a block that are together once its hubs are taken out, and the rows that they are in.
struct LinearPiece {
  std::vector<Index> poses;  // B is of their tangents, one behind the other
  LinearPose rows;
  RowMatrix by_hubs;  // the same by the tangents of the hubs
};

// Poses that rows couple, eliminated together. Hubs are those in so many rows that they hold the
// others together: their tangents h are unknowns of the pieces that they leave, rho_k + J_k d +
// H_k h = 0, until all pieces are eliminated. Of A = Q R, A the H_k above each other, Q' leaves all
// rows but the first ones, as many as A has rank, without h, and these are with the hubs' own rows
// those of one more pose. Q is a few reflections, so that this costs what its pieces do.
class LinearBlock {
 public:
  // `hubs` are a piece without hubs, and of no pose where there are none. Throws as
  // eliminate_pose().
  LinearBlock(std::vector<LinearPiece> pieces, LinearPiece hubs);

  // What is left: rho and J of the block. One that is not finite where a row is not.
  const Vector& conditions() const { return conditions_; }
  const RowMatrix& jacobian() const { return jacobian_; }

  // That of the hubs behind the others.
  const std::vector<LinearPiece>& pieces() const { return pieces_; }
  // Of each piece the errors of its rows and its poses' tangents, for a step d of the unknowns.
  struct Move {
    Vector errors, tangents;
  };
  std::vector<Move> moves(const Vector& d) const;
  // Of the rows of each piece: their multipliers, these multipliers' variances, and what of those
  // estimates of this covariance explain.
  std::vector<RowShares> shares(const RowMatrix& covariance) const;

 private:
  // G times what has a row for each condition: of the stacked conditions of the pieces, and of the
  // rows of the centre.
  struct Spread {
    RowMatrix pieces, centre;
  };
  Spread spread(const RowMatrix& of_conditions) const;

  std::vector<LinearPiece> pieces_;
  std::vector<Index> first_;  // of each piece but the hubs, among the stacked conditions
  Reflections reflections_;   // Q
  LinearPose centre_;         // rows of the hubs, and what those of the pieces say of them
  Vector conditions_;
  RowMatrix jacobian_;
};

}  // namespace symkin
