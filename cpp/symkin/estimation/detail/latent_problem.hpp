// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <map>
#include <vector>

#include "symkin/estimation/detail/latent_poses.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/detail/pair_rows.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/robust_loss.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// Maximum likelihood of all columns of a layout, the poses and the errors of their readings, which
// move together: poses converged for fixed parameters need not exist.
class LatentProblem {
 public:
  // `poses` are where the latent poses start; those in `aside` stay out.
  LatentProblem(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
                Setup setup, RowMatrix poses, std::vector<bool> aside);

  // Rows of the problem beside the poses and the priors: A z = 0, z the change since the start.
  void constrain(const RowMatrix& rows) { constraints_ = rows; }
  bool constrained() const { return constraints_.rows() > 0; }
  // Of the pose: none at first.
  void set_losses(const BlockLosses& losses) { losses_ = losses; }
  void take_in(Index pose, const double* start);

  Index size() const { return layout_.columns(); }
  bool linearise(NormalEquations& equations) { return linearise(equations, false); }
  bool linearise_gradient(NormalEquations& equations) { return linearise(equations, true); }
  void step(const Vector& d);
  // Without the poses and the errors of their readings.
  void finish(const Vector& d);
  void correct(const Vector& d);
  void undo();
  double step_size(const Vector& d) const {
    return d.size() == 0 ? 0 : d.cwiseQuotient(sizes_).cwiseAbs().maxCoeff();
  }
  // Whether the last step left the latent poses where they were, but for rounding.
  bool latents_at_rest() const {
    return largest_move_ < kStill || (largest_move_ < kRounding && largest_move_ >= last_move_);
  }
  // Whether all poses start at measured ones, and are nearly right with that.
  bool starts_near() const;

  const Setup& setup() const { return state_.setup; }
  const Vector& change() const { return state_.change; }
  const RowMatrix& poses() const { return state_.poses; }
  const RowMatrix& reading_errors() const { return state_.errors; }
  const std::vector<bool>& aside() const { return aside_; }
  // Of the last linearisation but of the gradient alone: J'WJ with the priors, without the
  // constraints.
  const RowMatrix& information() const { return now_.information; }
  // The part of the priors in it, and their rows, by steps from the present state.
  RowMatrix prior_information() const;
  RowMatrix prior_rows() const { return by_steps(layout_.prior_rows()); }
  // Of the last linearisation, of each pose: the number of its conditions, their sum of squares
  // and the weight of the loss; 0, 0 and 1 where it was set aside. Those of a block of poses stand
  // at its first.
  const std::vector<Index>& counts() const { return now_.counts; }
  const Vector& chi_squares() const { return now_.chi_squares; }
  const Vector& weights() const { return now_.weights; }
  double prior_squares() const { return now_.prior_squares; }
  // All conditions, a block a pose that has any, and behind them finite priors and the constraints.
  WhitenedSystem system() const;
  // What is left of its rows, of the first of a block of those of all; empty where it was set aside
  // or another stands for it.
  struct Left {
    Vector conditions;   // rho
    RowMatrix jacobian;  // J
  };
  Left left(Index pose) const;
  // The block that it is the first of; none where it is alone.
  const LinearBlock* block(Index pose) const {
    const auto found = now_.blocks.find(pose);
    return found == now_.blocks.end() ? nullptr : &found->second;
  }
  // Of one that is alone its linearised rows; empty where it was set aside.
  LinearPose linear(Index pose) const;
  // The same with the conditions as they were eliminated: of a row that was not taken there may be
  // one that says nothing.
  LinearPose as_eliminated(Index pose) const {
    const auto at = static_cast<std::size_t>(pose);
    return now_.general[at] ? now_.poses[at] : now_.rows.conditions(pose);
  }
  bool alone(Index pose) const { return blocks_.alone(pose); }

 private:
  // Of the robot's longest length, or of a radian.
  static constexpr double kStill = 1e-11;
  static constexpr double kRounding = 1e-8;

  // A frame whose rotation is free, or a part of it. A step turns it by R <- exp([d]) R, and of
  // several steps d is no sum: the change that priors and constraints are of is w of
  // R = exp([w]) R_start. Where a part is held, w is of R = exp([w]) R_drawn, and the change is
  // that of its free components; the others stay as they are, so that a step takes them with it: d
  // = J(w) dw, of which the held are J_hf J_ff^-1 times the free.
  struct Turn {
    std::vector<Index> free, columns;  // axes that are, and their columns
    std::vector<Index> held;
    Index first;  // scalar of the axes
    Frame Setup::*frame;
    Eigen::Matrix3d since;  // R_start or R_drawn
    Eigen::Vector3d start;  // w there
  };
  // Of a layout, to which they add ties of what is held.
  static std::vector<Turn> turns_of(PoseSpace space, const Setup& setup, Layout& layout);
  bool turns_have_priors() const;
  // w, and J_ff^-1 of it.
  Eigen::Vector3d turned(const Turn& turn) const;
  RowMatrix by_step(const Turn& turn) const;
  // Ties what is held of rotations to what is free, at the present state.
  void tie_turns();
  // Rows of the change as rows of a step from the present state.
  RowMatrix by_steps(RowMatrix rows) const;

  bool linearise(NormalEquations& equations, bool gradient_alone);
  LinearPose general(Index pose) const;
  void move_latent(Index pose, const double* tangent);
  void move_setup(const Vector& d);
  void take_errors(const std::vector<RowOrigin>& origins, const Vector& errors);

  struct State {
    Setup setup;
    Vector change;     // of the columns since the start
    RowMatrix poses;   // N x coordinates
    RowMatrix errors;  // N x legs, of the readings
  };

  // What a linearisation leaves behind.
  struct Linearisation {
    LatentPoses rows;
    std::vector<bool> general;            // poses that were not eliminated with the others
    std::vector<LinearPose> poses;        // of which these are, empty where there are none
    std::map<Index, LinearBlock> blocks;  // by the first of its poses
    std::vector<Index> counts;
    Vector chi_squares, weights;
    double prior_squares = 0;
    RowMatrix information;
  };

  const Mechanism& mechanism_;
  const Observations& observations_;
  Layout layout_;  // with ties of what is held of rotations
  BlockLosses losses_{RobustLoss{}};
  std::vector<bool> aside_;
  PoseBlocks blocks_;
  RowMatrix constraints_;
  std::vector<Turn> turns_;
  State state_, saved_;
  Linearisation now_;
  RowMatrix tangents_, errors_;  // room for moves
  double length_;                // the robot's longest
  Vector sizes_;                 // natural ones of the columns
  // Of the poses, by the last step and by the one before.
  double largest_move_ = std::numeric_limits<double>::infinity();
  double last_move_ = largest_move_;
};

}  // namespace symkin
