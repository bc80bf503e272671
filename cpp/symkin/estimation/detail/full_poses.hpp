// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/full_pose_kernels.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/detail/pose_rows.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// Poses that were measured in full, and nothing else of them but readings, while both frames are
// held: their own rows have no unknown, and the elimination is closed: of the legs' closures, with
// H = dh/dpose, the conditions have the covariance H Sigma H' + diag(g^2 sigma_q^2). This is what
// most robots are identified from.
class FullPoses {
 public:
  FullPoses(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
            const Setup& setup);

  bool any() const { return !of_legs_.empty(); }
  bool takes(Index pose) const { return taken_[static_cast<std::size_t>(pose)]; }

  // The latent poses, the errors of their readings and the closures at both, as LatentProblem has
  // them.
  struct State {
    const RowMatrix& poses;
    const RowMatrix& errors;
    const std::vector<ClosureRows>& legs;
  };

  // The conditions of all poses.
  void eliminate(const State& state);
  // Of a pose: false where the closed form loses digits; the number of its conditions and their sum
  // of squares.
  bool eliminated(Index pose) const;
  Index count(Index pose) const { return legs_read_[static_cast<std::size_t>(pose)]; }
  double chi_square(Index pose) const { return chi_squares_[pose]; }

  // Adds what these poses say at their weights.
  void add_to(NormalEquations& equations, const State& state, const Vector& weights,
              const std::vector<Index>& poses);

  // Of every pose the tangent, and the new errors of its readings, for a step d of the columns.
  struct Moves {
    RowMatrix tangents;  // N x dof
    RowMatrix errors;    // N x legs
  };
  void move(const State& state, const Vector& d, Moves& moves);

  // The covariance of the columns as one of the legs' own scalars, and what the fit says of the
  // rows of a pose with it.
  RowMatrix own_covariance(const RowMatrix& covariance, Index width) const;
  PoseRows rows_of(const State& state, Index pose, const RowMatrix& own) const;

 private:
  FullPoseRows rows(const State& state);
  std::vector<Index> columns(Index width) const;  // of the legs' own scalars

  const Mechanism& mechanism_;
  const Layout& layout_;
  UnknownList list_;
  Index legs_;
  std::vector<bool> taken_;
  std::vector<Index> legs_read_;
  Eigen::Matrix3d to_device_;             // turns the base's axes to those of the device
  RowMatrix measured_;                    // N x coordinates, carried into the base's frame
  RowMatrix pose_variances_;              // N x dof
  RowMatrix reading_variances_, unread_;  // N x legs, see FullPoseRows
  // Of the last elimination, a row a pose:
  RowMatrix precisions_, multipliers_, misfits_, turns_;
  Vector chi_squares_, pivots_;
  // Room for the legs' addresses and scalars.
  std::vector<FullPoseRows::OfLeg> of_legs_;
  RowMatrix information_, effects_;
  Vector gradient_;
};

}  // namespace symkin
