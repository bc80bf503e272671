// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/projection.hpp"

namespace symkin {

// Terms that the model of a robot does not have, as many of each leg, against residuals that the
// parameters no longer explain: all that F tests of any of them want, in one go.
class MissingTerms {
 public:
  // `terms`, one for each of the system's legs: what shows in the leg's closures at all measured
  // poses, a column a term.
  MissingTerms(const WhitenedClosures& system, const Projection& projection,
               std::vector<RowMatrix> terms);

  // What these terms of some legs (places in the system) explain of the residuals.
  struct Explained {
    Index rank = 0;     // of the terms that the parameters do not explain
    double square = 0;  // of the residuals
    double rms = 0;     // metres, in these legs' closures
    Vector alone;       // the square that each term would explain alone
  };
  Explained explained(const std::vector<Index>& legs) const;

 private:
  Vector whitened_lengths() const;
  void take_out_own_parameters(std::size_t leg);
  void whiten();
  std::vector<Index> columns_of(const std::vector<Index>& legs) const;
  RowMatrix square(const std::vector<Index>& columns) const;  // of what is not explained
  double rms(const std::vector<Index>& legs, const Vector& coefficients) const;

  const WhitenedClosures& system_;
  const Projection& projection_;
  Index count_;                   // terms of a leg
  std::vector<RowMatrix> terms_;  // of columns that whitened had length one
  // Of each leg the rows of its closures and the terms of it and the legs before it: whitened terms
  // do not show in the legs before.
  std::vector<RowMatrix> whitened_;
  RowMatrix by_basis_;  // Q' times the whitened terms
  Vector along_;        // the whitened terms times the residuals
};

}  // namespace symkin
