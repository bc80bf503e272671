// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "symkin/estimation/detail/whitened_closures.hpp"

namespace symkin {

// Residuals of a least-squares problem less what its parameters could still explain: e = (I - QQ')
// r, Q an orthonormal basis of the jacobian's columns. For standard normal closures e is that of a
// projected standard normal vector, whatever estimate the problem was linearised at.
//
// Everything is kept leg by leg. Whitening lets a leg's rows depend on the parameters of the legs
// before it alone; Q, made from the last leg's columns to the first leg's, is zero there too, and
// that is most of Q.
class Projection {
 public:
  // `left_out`, one a pose of the system, stay out of everything but `predicted`.
  Projection(const WhitenedClosures& system, std::vector<bool> left_out);

  const Vector& residual() const { return residual_; }  // 0 for poses left out
  double chi_square() const { return residual_.squaredNorm(); }
  Index degrees_of_freedom() const { return degrees_of_freedom_; }
  Index rank() const { return coordinates_.cols(); }
  bool counts(Index pose) const { return !left_out_[static_cast<std::size_t>(pose)]; }
  const std::vector<bool>& left_out() const { return left_out_; }

  // The closures of one leg, in the order of measuring.
  struct LegBlock {
    std::vector<Index> poses;  // of the system, where the leg was read
    std::vector<Index> rows;   // of the system, a closure
    RowMatrix basis;           // the last columns of these rows of Q, zero for poses left out
  };
  // One for each of the system's legs.
  const std::vector<LegBlock>& legs() const { return legs_; }
  // The jacobian times these is Q.
  const RowMatrix& coordinates() const { return coordinates_; }

  // Residual of one pose as the other poses predict it: of a pose that counts, the deleted one; of
  // one left out, the prediction error.
  struct Prediction {
    Vector standardised;  // the inverse of its covariance times the residual
    double square;        // of the residual, in that covariance
    RowMatrix inverse;    // of its covariance
    Index rank;
  };
  Prediction predicted(Index pose) const;

  // How many standard deviations e'Me / e'e is from its mean for sound residuals, M having one half
  // at every pair of rows, in both orders: closures of two legs at the same poses, and of every leg
  // at poses that follow each other. Nothing of fewer than two pairs.
  std::optional<double> legs_together(Index first, Index second) const;
  std::optional<double> neighbours() const;

 private:
  void find_legs();
  bool orthogonalise();         // by Cholesky; false where the columns are too nearly dependent
  void orthogonalise_anyhow();  // by QR with pivots
  void leave_out(const LegBlock& leg, RowMatrix& rows) const;
  RowMatrix rows_of_basis(const WhitenedPose& pose, bool counts) const;
  // `trace` of MR and `square` of (MR)^2, R = I - QQ'.
  std::optional<double> standardised(Index pairs, double value, double trace, double square) const;

  const WhitenedClosures& system_;
  Index closures_;  // of each leg
  std::vector<bool> left_out_;
  std::vector<LegBlock> legs_;
  std::vector<Index> places_;  // of each row of the system, in its leg's block
  RowMatrix coordinates_;
  Vector residual_;
  Vector explained_;  // Q' r
  Index degrees_of_freedom_ = 0;
};

}  // namespace symkin
