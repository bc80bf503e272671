// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

inline constexpr double kNoiseKnown = std::numeric_limits<double>::infinity();

// sum_i weight_i chi^2(degrees_i), the chi-squares independent: the distribution of a mean square
// error over poses, of parameters that are jointly normal.
class QuadraticForm {
 public:
  // One degree each.
  explicit QuadraticForm(const Vector& weights);
  QuadraticForm(const Vector& weights, const Vector& degrees);

  // Of x'Mx, x normal with mean zero and this covariance, M positive semidefinite.
  static QuadraticForm of(ConstRows mean_square, ConstRows covariance);

  const Vector& weights() const { return weights_; }
  double mean() const;
  double effective_degrees() const;  // of the chi-square with the same first two moments

  // Probability that it exceeds a value, exact to rounding: the integral of its characteristic
  // function along a hyperbola through the saddlepoint.
  double tail(double value) const;

  // What it, its weights positive, falls short of with a probability. With weights that are scaled
  // by an estimated variance of so many degrees of freedom, the quantile of form / (chi^2 /
  // degrees): times the estimated variance it is the bound.
  double quantile(double probability, double noise_degrees = kNoiseKnown) const;
  // The same of a value that is drawn from any of the forms, as likely from each.
  static double quantile_of_any(const std::vector<QuadraticForm>& forms, double probability,
                                double noise_degrees = kNoiseKnown);

 private:
  double tail_over_noise(double value, double noise_degrees) const;

  Vector weights_;  // none is zero
  Vector degrees_;
};

// Of several covariances that stand one below the other.
RowMatrix mean_covariance(ConstRows covariances);

// What x'Mx falls short of with a probability, x normal with mean zero and, as likely each, one of
// the covariances, which stand one below the other: of robots that are known alike well, but not
// equally. Exact for one covariance. For several the quantile of their mean is, and how much
// further it lies since they differ is that of chi-squares with the moments of each
// (Satterthwaite), right to some 0.1% where single ones are to 1%.
double mixed_quantile(ConstRows mean_square, ConstRows covariances, double probability,
                      double noise_degrees = kNoiseKnown);

}  // namespace symkin
