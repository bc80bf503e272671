// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/detail/pose_elimination.hpp"
#include "symkin/estimation/detail/row_plan.hpp"

namespace symkin {

// The m rows of one latent pose, linearised, and what is left of them (see PoseElimination).
struct LinearPose {
  std::vector<RowOrigin> origins;
  Vector misfit, variances;  // y and V
  RowMatrix by_pose;         // B, m x dof
  RowMatrix by_unknowns;     // C, m x columns
  PoseElimination elimination;
  Vector conditions;   // rho
  RowMatrix jacobian;  // J

  Index count() const { return conditions.size(); }
  void eliminate(Index pose) {
    elimination = eliminate_pose(by_pose, variances, pose);
    conditions = elimination.conditions.transpose() * misfit;
    jacobian = product(elimination.conditions.transpose(), by_unknowns);
  }
};

// Of the rows of a pose their multipliers, these multipliers' variances, and what of those
// estimates explain.
struct RowShares {
  Vector multipliers, variances, explained;
};

// The rows of all latent poses, linearised and eliminated a pose a lane. Where that loses digits,
// as where a pose has fewer rows than degrees of freedom, its rows are there for whoever takes more
// care.
class LatentPoses {
 public:
  LatentPoses(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
              const Setup& setup);

  // Takes the layout's ties, of the same scalars as before.
  void tie(const Layout& layout);
  // At a setup, poses (N x coordinates) and errors of the readings (N x legs); poses that are set
  // aside have rows of no meaning.
  void eliminate(const Setup& setup, const RowMatrix& poses, const RowMatrix& errors,
                 const std::vector<bool>& aside);
  // Of a pose: whether it was eliminated; the number of its conditions and their sum of squares.
  bool eliminated(Index pose) const { return clear_[pose] != 0; }
  Index count(Index pose) const;
  double chi_square(Index pose) const { return chi_squares_[pose]; }

  // Adds what those poses say at their weights, none of which may be that of a pose set aside; to
  // the information too, unless the gradient alone is wanted.
  void add_to(NormalEquations& equations, const Vector& weights, bool gradient_alone);
  // Of every pose the tangent (N x dof), and the new errors of its readings (N x legs), for a step
  // d of the columns.
  void move(const Vector& d, RowMatrix& tangents, RowMatrix& errors);

  // The rows of a pose; and, of one that was eliminated, what is left of them: of a row that was
  // not taken there may be a condition that says nothing.
  LinearPose rows(Index pose) const;
  LinearPose conditions(Index pose) const;
  // Of all poses the closures of a leg at their last linearisation, zero where it was not read; its
  // further ones without the reading.
  ClosureRows leg(Index leg) const;
  // Of the conditions G and rho alone.
  RowMatrix by_rows(Index pose) const;
  Vector values(Index pose) const;

 private:
  class OfPose;
  void linearise_leg(const Setup& setup, const RowMatrix& poses, const RowMatrix& errors, Index leg,
                     const std::vector<bool>& aside);
  void linearise_growing(const LegModel& model, const Vector& parameters, const Vector& growths,
                         const RowMatrix& poses, const Vector& shown, ClosureRows& rows);
  void add_covariates(const Setup& setup, const Vector& growths, Index leg, ClosureRows& rows);
  void keep_free(Index leg);
  void pack(const RowMatrix& poses);
  void linearise_packs(const Setup& setup, const RowMatrix& errors, Index leg,
                       const std::vector<bool>& aside);
  double packed(Index pose, Index leg, Index i) const;
  void set_places();
  LatentRows kernel_rows(const double* poses, const double* errors);

  const Mechanism& mechanism_;
  const Observations& observations_;
  UnknownList list_;
  // Scalars of a leg that may be free: no curvature where it is held, no slopes without covariates.
  Index own_;
  bool curved_ = false;  // whether some curvature is free
  // Of each leg those that are, and of most legs how many: others have columns of zeros besides.
  std::vector<std::vector<Index>> own_free_;
  Index width_ = 1;
  std::vector<Index> free_;  // scalars of the legs, `width_` of each, and the shared ones; or -1
  // How each of those moves with the columns: its own, if it has one, and what it is tied to.
  struct Share {
    Index column;
    double factor;
  };
  std::vector<Share> shares_;
  std::vector<std::size_t> first_share_;  // of each, and behind the last
  struct Shares {
    const Share *first, *last;
    const Share* begin() const { return first; }
    const Share* end() const { return last; }
  };
  Shares shares(Index i) const {
    const std::size_t* const at = &first_share_[static_cast<std::size_t>(i)];
    return {shares_.data() + at[0], shares_.data() + at[1]};
  }
  std::vector<Index> shared_of_;  // see LatentRows
  Index column_count_, shared_ = 0;
  int directions_;
  RowPlan plan_;
  LatentRows::Places places_{};
  // Of the last linearisation: of each leg, zero where it was not read, by_parameters by its first
  // `own_` scalars in the UnknownList, and by those of them that are free.
  std::vector<ClosureRows> legs_;
  std::vector<bool> whole_;  // where these are all
  std::vector<RowMatrix> by_free_;
  // Instead of both, of legs that need nothing more, those that are written a pose a lane: what
  // LegModel::linearise_lanes() takes, and of each leg what it writes.
  bool may_pack_ = false, is_packed_ = false;
  std::vector<double> packed_parameters_, packed_poses_, packed_readings_;
  std::vector<std::vector<double>> packs_;
  RowMatrix given_;                   // N x legs, readings; 0 where none was taken
  Vector own_parameters_, readings_;  // of one leg
  RowMatrix bases_;                   // of every pose, or of all: position and rotation by rows
  RowMatrix base_turns_;              // see LatentRows
  Vector target_, scalars_, room_, chi_squares_, clear_;
  std::vector<LatentRows::OfLeg> of_legs_;
};

}  // namespace symkin
