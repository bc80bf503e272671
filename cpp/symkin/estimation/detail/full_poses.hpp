// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// Poses that were measured in full, and nothing else of them but readings, while both frames are
// held: their own rows have no unknown, and the elimination is closed: of the legs' closures, with
// H = dh/dpose, the conditions have the covariance H Sigma H' + diag(g^2 sigma_q^2). This is what
// most robots are identified from, and it is 20 times the speed of the general elimination.
class FullPoses {
 public:
  FullPoses(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
            const Setup& setup);

  bool takes(Index pose) const { return taken_[static_cast<std::size_t>(pose)]; }

  // The latent poses, the errors of their readings and the closures at both, as LatentProblem has
  // them. `by_unknowns`: of each leg, a row a pose, by the leg's scalars of the UnknownList.
  struct State {
    const RowMatrix& poses;
    const RowMatrix& errors;
    const std::vector<ClosureRows>& legs;
    const std::vector<RowMatrix>& by_unknowns;
    const std::vector<Vector>& gains;  // of each leg, dq/dpsi at each reading
  };

  // Conditions of a pose and their sum of squares; false where the closed form loses digits.
  bool eliminate(const State& state, Index pose);
  Index count(Index pose) const { return legs_read_[static_cast<std::size_t>(pose)]; }
  double chi_square(Index pose) const { return chi_squares_[pose]; }

  // Adds what all poses taken, but those in `others`, say at their weights.
  void add_to(NormalEquations& equations, const State& state, const Vector& weights,
              const std::vector<bool>& others);

  // The pose's tangent, and the new errors of its readings, for a step d of the columns.
  Vector move(const State& state, Index pose, const Vector& d,
              Eigen::Ref<Eigen::RowVectorXd> errors) const;

 private:
  // Pointers, so that linearisations can be swapped.
  const Mechanism* mechanism_;
  const Observations* observations_;
  const Layout* layout_;
  UnknownList list_;
  Index legs_, dof_;
  std::vector<bool> taken_;
  std::vector<Index> legs_read_;
  RowMatrix measured_;  // N x coordinates, carried into the base's frame
  // Of the last elimination, a row a pose:
  RowMatrix by_pose_;      // legs x dof, H P^-1
  RowMatrix precisions_;   // legs x legs, inverse of the conditions' covariance
  RowMatrix multipliers_;  // legs, that times the conditions
  RowMatrix misfits_;      // dof, of the measured pose
  RowMatrix turns_;        // 3 x 3, P^-1 of the orientation (spatial)
  Vector chi_squares_;
};

}  // namespace symkin
