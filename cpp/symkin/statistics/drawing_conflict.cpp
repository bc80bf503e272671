// SPDX-License-Identifier: MIT
#include "symkin/statistics/drawing_conflict.hpp"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <string>

#include "symkin/statistics/distributions.hpp"
#include "symkin/statistics/quadratic_form.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kShown = 0.1;      // eigenvalue of a direction that the data show
constexpr double kRounding = 1e-9;  // eigenvalues below are of directions that they do not
constexpr double kFarthest = 14;    // of log f, either way
constexpr int kTried = 280;         // steps of it before the best is refined

void check(const Vector& change, ConstRows covariance, const Vector& deviations) {
  const Index size = change.size();
  if (covariance.rows() != size || covariance.cols() != size || deviations.size() != size) {
    throw InvalidInput("there are " + std::to_string(size) + " changes, a covariance of " +
                       std::to_string(covariance.rows()) + " x " +
                       std::to_string(covariance.cols()) + " and " +
                       std::to_string(deviations.size()) + " deviations; expected one for each");
  }
  if (!change.allFinite() || !covariance.allFinite() || !deviations.allFinite() ||
      (deviations.array() <= 0).any()) {
    throw InvalidInput(
        "a conflict with the drawing is asked for finite changes and deviations above zero");
  }
}

// Minus twice the log of the likelihood of directions with squares u^2, made at f times the
// tolerances.
double unlikeliness(const Vector& mu, const Vector& squares, double log_factor) {
  const Eigen::ArrayXd variances = 1 + std::expm1(2 * log_factor) * mu.array();
  return (variances.log() + squares.array() / variances).sum();
}

// log f of the largest likelihood.
double most_likely(const Vector& mu, const Vector& squares) {
  const auto unlikely = [&](double log_factor) { return unlikeliness(mu, squares, log_factor); };
  double best = 0;
  for (int k = -kTried; k <= kTried; ++k) {
    const double tried = kFarthest * k / kTried;
    best = unlikely(tried) < unlikely(best) ? tried : best;
  }
  const double step = kFarthest / kTried;
  return boost::math::tools::brent_find_minima(unlikely, best - step, best + step, 40).first;
}

}  // namespace

DrawingConflict drawing_conflict(const Vector& change, ConstRows covariance,
                                 const Vector& deviations) {
  check(change, covariance, deviations);
  const Vector units = deviations.cwiseInverse();
  RowMatrix left = -(units.asDiagonal() * covariance * units.asDiagonal());
  left.diagonal().array() += 1;
  const SymmetricEigen eigen = symmetric_eigen(left);
  const Vector along = eigen.vectors.transpose() * change.cwiseProduct(units);
  DrawingConflict found;
  Vector mu(along.size());
  Vector squares(along.size());
  Index count = 0;
  for (Index i = 0; i < along.size(); ++i) {
    const double value = eigen.values[i];
    if (value > kRounding) {
      mu[count] = std::min(value, 1.0);
      squares[count] = along[i] * along[i] / value;
      found.weighted += along[i] * along[i];
      found.directions += value > kShown ? 1 : 0;
      found.q += value > kShown ? squares[count] : 0;
      ++count;
    }
  }
  if (found.directions == 0) {
    return {};
  }
  found.p_large = chi_square_tail(found.q, static_cast<double>(found.directions));
  found.p_small = 1 - QuadraticForm(mu.head(count)).tail(found.weighted);
  found.ratio = found.q / static_cast<double>(found.directions);
  mu.conservativeResize(count);
  squares.conservativeResize(count);
  const double likely = most_likely(mu, squares);
  found.factor = std::exp(likely);
  found.as_drawn =
      std::max(unlikeliness(mu, squares, -kFarthest) - unlikeliness(mu, squares, likely), 0.0);
  return found;
}

}  // namespace symkin
