// SPDX-License-Identifier: MIT
#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <deque>
#include <memory>
#include <utility>

#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

using Evaluated = Eigen::Map<Vector>;

// The residuals of a leg and their derivatives by its estimated parameters wherever Ceres looks:
// all poses at once, since a chain writes its rows in batches.
class Rows final : public ceres::EvaluationCallback {
 public:
  Rows(const LegData& data, Vector parameters, bool in_readings)
      : data_(data), parameters_(std::move(parameters)), in_readings_(in_readings) {
    values_ = parameters_(data_.estimated);
    linearise();
  }

  void PrepareForEvaluation(bool /*jacobians*/, bool new_point) override {
    if (new_point) {
      parameters_(data_.estimated) = values_;
      linearise();
    }
  }

  double* values() { return values_.data(); }
  const Vector& estimated() const { return values_; }
  const Vector& parameters() const { return parameters_; }
  const ClosureRows& rows() const { return rows_; }
  // Also after a step that Ceres tried and did not take.
  void settle() { PrepareForEvaluation(true, true); }

 private:
  void linearise() {
    (in_readings_ ? linearise_readings : linearise_closures)(data_, parameters_, rows_);
  }

  const LegData& data_;
  Vector parameters_, values_;
  bool in_readings_;
  ClosureRows rows_;
};

// r_j = T_j h_j, the residuals of pose j: its closures h, k x 1, whitened by the noise as it is
// held (see HeldNoise), or of `inverse` g - psi over one deviation.
class PoseResidual final : public ceres::CostFunction {
 public:
  PoseResidual(const Rows& rows, const RowMatrix& transforms, Index pose)
      : rows_(rows), transforms_(transforms), pose_(pose) {
    set_num_residuals(static_cast<int>(transforms.cols()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(rows.estimated().size()));
  }

  bool Evaluate(double const* const* /*values*/, double* residuals,
                double** jacobians) const override {
    const Index k = transforms_.cols();
    const auto transform = transforms_.middleRows(k * pose_, k);
    Evaluated result(residuals, k);
    result = transform * rows_.rows().closure.segment(k * pose_, k);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      const auto by_parameters = rows_.rows().by_parameters.middleRows(k * pose_, k);
      Eigen::Map<RowMatrix>(jacobians[0], k, by_parameters.cols()).noalias() =
          transform.lazyProduct(by_parameters);
    }
    return result.allFinite();
  }

 private:
  const Rows& rows_;
  const RowMatrix& transforms_;
  Index pose_;
};

// Ceres stops where the cost no longer shows a step, half of the digits early; see settle().
ceres::Solver::Options solver_options(int steps) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.logging_type = ceres::SILENT;
  solver.initial_trust_region_radius = 1e12;  // Gauss-Newton, where that lowers the cost
  solver.max_num_iterations = steps;
  solver.function_tolerance = 1e-12;
  solver.gradient_tolerance = solver.parameter_tolerance = 1e-16;
  return solver;
}

// A leg as a ceres::Problem: one residual block a pose, the loss on each.
class LegInCeres {
 public:
  LegInCeres(const LegData& data, const Vector& start, const BlockLoss& loss,
             const IdentificationOptions& options)
      : data_(data),
        loss_(loss),
        options_(options),
        in_readings_(options.estimator == Estimator::inverse),
        rows_(data, start, in_readings_) {}

  bool starts() const { return rows_.rows().closure.allFinite(); }
  const Rows& rows() const { return rows_; }

  // Solves with the noise as it is at the present parameters.
  ceres::Solver::Summary solve(int steps) {
    const HeldNoise held = hold_noise(data_, rows_.parameters(), options_.noise, in_readings_);
    ceres::Problem::Options owner;
    owner.cost_function_ownership = owner.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    owner.evaluation_callback = &rows_;
    ceres::Problem problem(owner);
    std::deque<PoseResidual> residuals;
    std::vector<std::unique_ptr<ceres::LossFunction>> losses;
    for (Index pose = 0; pose < data_.readings.size(); ++pose) {
      losses.push_back(loss_.function(held.relative[pose]));
      problem.AddResidualBlock(&residuals.emplace_back(rows_, held.transforms, pose),
                               losses.back().get(), rows_.values());
    }
    ceres::Solver::Summary summary;
    ceres::Solve(solver_options(steps), &problem, &summary);
    rows_.settle();
    return summary;
  }

 private:
  const LegData& data_;
  const BlockLoss& loss_;
  const IdentificationOptions& options_;
  bool in_readings_;
  Rows rows_;
};

}  // namespace

LegEstimate fit_by_ceres(const LegData& data, const Vector& start, const BlockLoss& loss,
                         const IdentificationOptions& options) {
  constexpr int kMostPasses = 10;
  LegEstimate estimate;
  estimate.parameters = start;
  SolverOutcome& outcome = estimate.outcome;
  const int steps = (loss.any() ? kRobustSteps : 1) * options.max_iterations;
  for (int pass = 0; outcome.failure.empty() && !outcome.converged; ++pass) {
    check_interrupt();
    LegInCeres leg(data, estimate.parameters, loss, options);
    if (!leg.starts()) {
      outcome.failure = options.estimator == Estimator::inverse
                            ? out_of_reach_at_start(leg.rows().rows().closure)
                            : "the residuals are not finite at the start";
      break;
    }
    const ceres::Solver::Summary summary = leg.solve(steps);
    outcome.iterations += summary.num_successful_steps;
    estimate.cost = 2 * summary.final_cost;
    estimate.parameters = leg.rows().parameters();
    const bool ended = summary.termination_type == ceres::CONVERGENCE;
    // Weights may also settle so slowly that only Newton's steps end.
    outcome.converged = (ended || loss.any()) && settle(data, loss, options, estimate);
    if (!outcome.converged && summary.termination_type == ceres::NO_CONVERGENCE) {
      outcome.failure = "no convergence in " + std::to_string(steps) + " steps";
    } else if (!outcome.converged && !ended) {
      outcome.failure = "no step lowers the cost";
    } else if (!outcome.converged && pass == kMostPasses) {
      outcome.failure = "the variances still move the estimate";
    }
  }
  if (!outcome.converged) {
    whiten(data, estimate.parameters, options.noise, estimate.whitened);
    estimate.loss_weights.setOnes(estimate.whitened.factors.size());
  }
  return estimate;
}

}  // namespace symkin
