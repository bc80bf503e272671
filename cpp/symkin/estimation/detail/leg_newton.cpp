// SPDX-License-Identifier: MIT
#include <cmath>
#include <utility>

#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Residuals of a leg as they are fitted, their derivatives in `leg`, and the noise of each pose in
// them (empty: one).
struct Fitted {
  WhitenedLeg leg;
  Vector relative;
};

void linearise(const LegData& data, const Vector& parameters, const IdentificationOptions& options,
               Fitted& fitted) {
  if (options.estimator != Estimator::inverse) {
    whiten(data, parameters, options.noise, fitted.leg);
    return;
  }
  linearise_readings(data, parameters, fitted.leg.rows);
  const auto [typical, relative] = reading_noise(data, parameters, options.noise);
  fitted.relative = relative;
  fitted.leg.factors.setConstant(relative.size(), 1 / typical);
}

// Of the loss with its second derivatives, or where those have no minimum of the loss with its
// weights alone; and the root of the squares of what it changes in the residuals.
std::pair<Vector, double> newton_step(const Fitted& fitted, const BlockLoss& loss,
                                      Vector& weights) {
  constexpr double kPoor = 1e-9;
  const Index k = loss.conditions();
  RowMatrix rows = fitted.leg.factors.asDiagonal() * fitted.leg.rows.by_parameters;
  Vector residuals = fitted.leg.rows.closure.cwiseProduct(fitted.leg.factors);
  weights.resize(residuals.size());
  RowMatrix curvature = RowMatrix::Zero(rows.cols(), rows.cols());
  for (Index first = 0; first < rows.rows(); first += k) {
    auto own = rows.middleRows(first, k);
    auto residual = residuals.segment(first, k);
    const BlockLoss::Value value =
        loss.at(residual.squaredNorm(), fitted.relative.size() > 0 ? fitted.relative[first] : 1);
    if (loss.any()) {
      const Vector along = own.transpose() * residual;
      curvature.noalias() += (2 * value.by_square * along) * along.transpose();
    }
    weights.segment(first, k).setConstant(value.weight);
    own *= std::sqrt(value.weight);
    residual *= std::sqrt(value.weight);
  }
  if (loss.any()) {
    curvature.noalias() += rows.transpose() * rows;
    ScaledCholesky cholesky;
    cholesky.compute(curvature);
    if (cholesky.least_pivot() > kPoor) {
      Vector step;
      cholesky.solve(rows.transpose() * residuals, step);
      return {-step, (rows * step).norm()};
    }
  }
  const Vector step = -scaled_least_squares(rows, residuals);
  return {step, (rows * step).norm()};
}

}  // namespace

bool settle(const LegData& data, const BlockLoss& loss, const IdentificationOptions& options,
            LegEstimate& estimate) {
  constexpr int kSteps = 20;
  constexpr double kStill = 1e-9;  // standard deviations
  constexpr double kNear = 0.3;
  Fitted fitted;
  for (int step = 0; step < kSteps; ++step) {
    linearise(data, estimate.parameters, options, fitted);
    if (!fitted.leg.rows.closure.allFinite()) {
      return false;
    }
    const auto [newton, size] = newton_step(fitted, loss, estimate.loss_weights);
    if (!(size < kNear)) {
      return false;
    }
    estimate.parameters(data.estimated) += newton;
    if (size < kStill) {
      whiten(data, estimate.parameters, options.noise, estimate.whitened);
      return true;
    }
  }
  return false;
}

}  // namespace symkin
