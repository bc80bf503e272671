// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_estimators.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// Starts as Gauss-Newton, which needs a handful of steps; damped when a step fails.
constexpr double kFirstDamping = 0;
// With a loss the weights and the spread settle one after the other.
constexpr int kRobustSteps = 5;  // times those without

// g - psi on the sensor's turn in `rows.closure`, NaN where the leg does not reach, and dg/dparam
// (Eqs. 8, 15) in `rows.by_parameters`.
void linearise_readings(const LegData& data, const Vector& parameters, ClosureRows& rows) {
  Vector roots(data.readings.size());
  data.model.inverse_kinematics(parameters, data.working_mode, data.poses, roots);
  Vector errors(roots.size());
  data.model.reading_differences(parameters, roots, data.readings, errors);
  data.model.linearise(parameters, data.poses, data.readings + errors, rows);
  rows.by_parameters.array().colwise() /= -rows.by_reading.array();
  rows.closure = errors;
}

// Typical standard deviation of g - psi.
double reading_deviation(const LegData& data, const Vector& parameters,
                         const MeasurementNoise& noise) {
  ClosureRows rows;
  data.model.linearise_pose(parameters, data.poses, data.readings, rows);
  const Vector variances = closure_variances(rows, data.model.info().pose_space, noise);
  return std::sqrt((variances.array() / rows.by_reading.array().square()).mean());
}

// The first pose without a reading.
std::string unreached_pose(const Vector& errors) {
  Index row = 0;
  errors.array().isFinite().cast<int>().minCoeff(&row);
  return "measured pose " + std::to_string(row + 1);
}

// x of least |A x - b|, by QR with columns of length one.
Vector least_squares(const RowMatrix& a, const Vector& b) {
  const Vector scale = inverse_column_lengths(a);
  const ColumnSpace space = column_space(a * scale.asDiagonal());
  return scale.asDiagonal() * (space.coordinates * (space.basis.transpose() * b));
}

// The residuals of a leg over their standard deviations. These and the robust weights are taken
// anew wherever the solver goes.
class LegProblem {
 public:
  LegProblem(const LegData& data, const Vector& start, const IdentificationOptions& options)
      : data_(data), options_(options) {
    now_.parameters = start;
  }

  Index size() const { return now_.parameters.size(); }

  bool linearise(NormalEquations& equations) {
    set_residuals();
    const RobustLoss& loss = options_.loss;
    const bool plain = loss.kind == RobustLoss::Kind::none;
    now_.residuals = now_.raw().cwiseProduct(now_.factors);
    now_.spread = loss.spread(now_.residuals);
    now_.weights.setOnes(now_.residuals.size());
    root_weights_ = now_.factors;
    weighted_residuals_ = now_.residuals;
    equations.cost = now_.residuals.squaredNorm();
    double former_cost = equations.cost;
    if (moved_) {
      former_residuals_ = now_.raw().cwiseProduct(former_.factors);
      former_cost = former_residuals_.squaredNorm();
    }
    if (!plain) {
      equations.cost = 0;
      for (Index k = 0; k < now_.residuals.size(); ++k) {
        const double square = now_.residuals[k] * now_.residuals[k];
        const RobustLoss::Value value = loss.evaluate(square, now_.spread);
        equations.cost += value.cost;
        now_.weights[k] = value.weight;
        root_weights_[k] *= std::sqrt(value.weight);
        weighted_residuals_[k] *= std::sqrt(value.weight);
      }
      former_cost = equations.cost;
      if (moved_) {
        former_cost = 0;
        for (const double residual : former_residuals_) {
          former_cost += loss.evaluate(residual * residual, former_.spread).cost;
        }
      }
    }
    equations.by_new_weights = equations.cost - former_cost;
    weighted_ = root_weights_.asDiagonal() * now_.rows.by_parameters;
    equations.information.noalias() = weighted_.transpose() * weighted_;
    equations.gradient.noalias() = weighted_.transpose() * weighted_residuals_;
    return std::isfinite(equations.cost) && equations.gradient.allFinite();
  }

  void step(const Vector& d) {
    std::swap(now_, former_);
    now_.parameters = former_.parameters + d;
    moved_ = true;
  }
  void undo() { std::swap(now_, former_); }
  bool still() const { return true; }
  double extent(const Vector& d) const {
    return d.cwiseQuotient(now_.parameters.cwiseAbs().cwiseMax(1)).lpNorm<Eigen::Infinity>();
  }
  bool orthogonal_step(Vector& d) const {
    d = -least_squares(weighted_, weighted_residuals_);
    return true;
  }

  // Where the solver ended.
  const Vector& parameters() const { return now_.parameters; }
  const Vector& errors() const { return now_.raw(); }
  const Vector& loss_weights() const { return now_.weights; }

 private:
  struct State {
    Vector parameters;
    ClosureRows rows;   // of the closures, or of g - psi
    Vector factors;     // one over the standard deviations
    Vector residuals;   // standardised
    Vector weights;     // of the loss
    double spread = 1;  // of the residuals

    const Vector& raw() const { return rows.closure; }
  };

  void set_residuals() {
    if (options_.estimator == Estimator::inverse) {
      linearise_readings(data_, now_.parameters, now_.rows);
      // One factor for all poses, so that the loss counts in standard deviations and the cost stays
      // the paper's.
      if (!moved_ || options_.loss.kind != RobustLoss::Kind::none) {
        deviation_ = reading_deviation(data_, now_.parameters, options_.noise);
      }
      now_.factors.setConstant(now_.raw().size(), 1 / deviation_);
      return;
    }
    data_.model.linearise(now_.parameters, data_.poses, data_.readings, now_.rows);
    now_.factors = closure_variances(now_.rows, data_.model.info().pose_space, options_.noise)
                       .cwiseSqrt()
                       .cwiseInverse();
  }

  const LegData& data_;
  const IdentificationOptions& options_;
  State now_, former_;  // `former_` is where the last step began
  bool moved_ = false;
  double deviation_ = 1;
  Vector root_weights_, weighted_residuals_, former_residuals_;
  RowMatrix weighted_;
};

}  // namespace

LegEstimate estimate_paper(const LegData& data, const Vector& start,
                           const IdentificationOptions& options) {
  LegEstimate estimate;
  estimate.parameters = start;
  estimate.loss_weights = Vector::Ones(data.readings.size());
  SolverOutcome& outcome = estimate.outcome;
  ClosureRows rows;
  for (; outcome.iterations < options.max_iterations; ++outcome.iterations) {
    linearise_readings(data, estimate.parameters, rows);
    if (!rows.closure.allFinite()) {
      outcome.failure = "iteration " + std::to_string(outcome.iterations + 1) + " put " +
                        unreached_pose(rows.closure) + " of the leg out of its reach";
      return estimate;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = least_squares(rows.by_parameters, rows.closure);
    estimate.parameters -= step;
    const Vector size = estimate.parameters.cwiseAbs().cwiseMax(1);
    if (step.cwiseQuotient(size).lpNorm<Eigen::Infinity>() < 1e-11) {
      outcome.converged = true;
      return estimate;
    }
  }
  outcome.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  return estimate;
}

LegEstimate estimate_whitened(const LegData& data, const Vector& start,
                              const IdentificationOptions& options) {
  LegProblem problem(data, start, options);
  LegEstimate estimate;
  const int steps = options.loss.kind == RobustLoss::Kind::none
                        ? options.max_iterations
                        : kRobustSteps * options.max_iterations;
  estimate.outcome = minimise(problem, {steps, kFirstDamping});
  if (!problem.errors().allFinite()) {
    estimate.outcome.failure =
        unreached_pose(problem.errors()) + " is out of the leg's reach at the start";
  }
  estimate.parameters = problem.parameters();
  estimate.loss_weights = problem.loss_weights();
  return estimate;
}

}  // namespace symkin
