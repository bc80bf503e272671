// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include "symkin/estimation/detail/full_poses.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/detail/pose_elimination.hpp"
#include "symkin/estimation/detail/pose_rows.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/robust_loss.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// One latent pose, linearised at the present state, and what is left of it (see PoseElimination).
struct LinearPose {
  std::vector<RowOrigin> origins;  // of its m rows
  Vector misfit, variances;        // y and V
  RowMatrix by_unknowns;           // C, m x columns
  PoseElimination elimination;
  Vector conditions;   // rho
  RowMatrix jacobian;  // J

  Index count() const { return conditions.size(); }
};

// Maximum likelihood of all columns of a layout, the poses and the errors of their readings, which
// move together: poses converged for fixed parameters need not exist.
class LatentProblem {
 public:
  // `poses` are where the latent poses start; those in `aside` stay out.
  LatentProblem(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
                Setup setup, RowMatrix poses, std::vector<bool> aside);

  // Rows of the problem beside the poses and the priors: A z = 0, z the change since the start.
  void constrain(const RowMatrix& rows) { constraints_ = rows; }
  // Of the pose: none at first.
  void set_losses(const BlockLosses& losses) { losses_ = losses; }
  void take_in(Index pose, const double* start);

  Index size() const { return layout_.columns(); }
  bool linearise(NormalEquations& equations);
  void step(const Vector& d);
  void undo();
  double extent(const Vector& d) const {
    return d.size() == 0 ? 0 : d.cwiseQuotient(sizes_).cwiseAbs().maxCoeff();
  }
  // Whether the last step left the latent poses where they were, but for rounding.
  bool still() const {
    return largest_move_ < kStill || (largest_move_ < kRounding && largest_move_ >= last_move_);
  }
  // Whether all poses start at measured ones, and are nearly right with that.
  bool starts_near() const;

  const Setup& setup() const { return state_.setup; }
  const Vector& change() const { return state_.change; }
  const RowMatrix& poses() const { return state_.poses; }
  const RowMatrix& reading_errors() const { return state_.errors; }
  const std::vector<bool>& aside() const { return aside_; }
  // Of the last linearisation: J'WJ with the priors, without the constraints.
  const RowMatrix& information() const { return now_.information; }
  // Of the last linearisation, of each pose: the number of its conditions, their sum of squares
  // and the weight of the loss; 0, 0 and 1 where it was set aside.
  const std::vector<Index>& counts() const { return now_.counts; }
  const Vector& chi_squares() const { return now_.chi_squares; }
  const Vector& weights() const { return now_.weights; }
  // Its linearised rows, empty where it was set aside.
  LinearPose linear(Index pose) const;
  // Of each pose that is not set aside, for estimates of this covariance of the columns.
  template <typename Take>
  void each_rows(const RowMatrix& covariance, const Take& take) const {
    const RowMatrix own =
        now_.full.any() ? now_.full.own_covariance(covariance, width_) : RowMatrix();
    for (std::size_t k = 0; k < aside_.size(); ++k) {
      const auto pose = static_cast<Index>(k);
      if (now_.general[k]) {
        take(pose, rows_of(now_.poses[k], covariance));
      } else if (!aside_[k]) {
        take(pose, now_.full.rows_of({state_.poses, state_.errors, now_.legs}, pose, own));
      }
    }
  }

 private:
  // Of the robot's longest length, or of a radian.
  static constexpr double kStill = 1e-11;
  static constexpr double kRounding = 1e-8;

  double extent_of_pose(const Vector& move) const;
  static PoseRows rows_of(const LinearPose& pose, const RowMatrix& covariance);

  struct State {
    Setup setup;
    Vector change;     // of the columns since the start
    RowMatrix poses;   // N x coordinates
    RowMatrix errors;  // N x legs, of the readings
  };

  // What a linearisation leaves behind.
  struct Linearisation {
    // Of each leg, zero where it was not read: by_parameters is by the first `width_` scalars that
    // the leg has in the UnknownList.
    std::vector<ClosureRows> legs;
    FullPoses full;
    std::vector<bool> general;      // poses that `full` does not take
    std::vector<LinearPose> poses;  // of which these are, empty where there are none
    std::vector<Index> counts;
    Vector chi_squares, weights;
    RowMatrix information;
  };

  void linearise_leg(Index leg, ClosureRows& rows) const;
  void assemble(Index pose, LinearPose& linear) const;

  const Mechanism& mechanism_;
  const Observations& observations_;
  const Layout& layout_;
  UnknownList list_;
  Index width_;  // scalars of a leg that may be free: without its sensor's curvature if held
  BlockLosses losses_{RobustLoss{}};
  std::vector<bool> aside_;
  RowMatrix constraints_;
  State state_, saved_;
  Linearisation now_;
  FullPoses::Moves moves_;
  double length_;  // the robot's longest
  Vector sizes_;   // natural ones of the columns
  // Of the poses, by the last step and by the one before.
  double largest_move_ = std::numeric_limits<double>::infinity();
  double last_move_ = largest_move_;
};

}  // namespace symkin
