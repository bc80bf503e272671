// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include "symkin/estimation/detail/whitened_closures.hpp"

namespace symkin {

// Residuals of a least-squares problem less what its parameters could still explain: e = (I - QQ')
// r, Q an orthonormal basis of the jacobian's columns. For standard normal closures e is that of a
// projected standard normal vector, whatever estimate the problem was linearised at.
class Projection {
 public:
  // `left_out`, one a pose of the system, stay out of everything but `predicted`.
  Projection(const WhitenedClosures& system, const std::vector<bool>& left_out);

  const Vector& residual() const { return residual_; }  // 0 for poses left out
  double chi_square() const { return residual_.squaredNorm(); }
  Index degrees_of_freedom() const { return degrees_of_freedom_; }

  // Rows of the system with zeros for the poses left out.
  RowMatrix kept(RowMatrix rows) const;

  // Columns of terms that the model does not have, less what the parameters explain; zero for poses
  // left out.
  RowMatrix unexplained(RowMatrix terms) const;

  // Residual of one pose as the other poses predict it, and its covariance: of a pose that counts,
  // the deleted one; of one left out, the prediction error.
  std::pair<Vector, RowMatrix> predicted(std::size_t pose) const;
  bool counts(std::size_t pose) const { return !left_out_[pose]; }

  // How many standard deviations e'Me / e'e is from its mean for sound residuals, M having one half
  // at every pair of rows, in both orders.
  double quadratic_form(const std::vector<std::pair<Index, Index>>& pairs) const;

 private:
  const WhitenedClosures& system_;
  std::vector<bool> left_out_;
  RowMatrix basis_;      // Q, m x rank, zero rows for poses left out
  RowMatrix leverages_;  // jacobian in the coordinates of Q, whose rows are those of Q but
                         // for poses left out
  Vector residual_;
  Vector explained_;  // Q' r
  Index degrees_of_freedom_;
};

}  // namespace symkin
