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
// Of a standard deviation: the joint fit goes much further from where the legs' own begin it. With
// a loss it may end elsewhere.
constexpr double kJointStart = 1e-2;
// With a loss the weights and the spread settle one after the other.
constexpr int kRobustSteps = 5;  // times those without

void keep_estimated(const LegData& data, ClosureRows& rows) {
  if (static_cast<Index>(data.estimated.size()) < rows.by_parameters.cols()) {
    rows.by_parameters = RowMatrix(rows.by_parameters(kAll, data.estimated));
  }
}

// g - psi on the sensor's turn in `rows.closure`, NaN where the leg does not reach, and dg/dparam
// (Eqs. 8, 15) in `rows.by_parameters`.
void linearise_readings(const LegData& data, const Vector& parameters, ClosureRows& rows) {
  Vector roots(data.readings.size());
  data.model.inverse_kinematics(parameters, data.working_mode, data.poses, roots);
  Vector errors(roots.size());
  data.model.reading_differences(parameters, roots, data.readings, errors);
  data.model.linearise(parameters, data.poses, data.readings + errors, rows);
  keep_estimated(data, rows);
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

// The largest of a step of the estimated parameters, of those beyond 1 over their size.
double relative_step(const LegData& data, const Vector& parameters, const Vector& step) {
  double largest = 0;
  for (Index i = 0; i < step.size(); ++i) {
    const double size = std::abs(parameters[data.estimated[static_cast<std::size_t>(i)]]);
    largest = std::max(largest, std::abs(step[i]) / std::max(size, 1.0));
  }
  return largest;
}

// x of least |A x - b|, by QR with columns of length one.
Vector least_squares(const RowMatrix& a, const Vector& b) {
  const Vector scale = inverse_column_lengths(a);
  const ColumnSpace space = column_space(a * scale.asDiagonal());
  return scale.asDiagonal() * (space.coordinates * (space.basis.transpose() * b));
}

// The residuals of a leg over their standard deviations, which are taken anew with the robust
// weights wherever the solver goes.
class LegProblem {
 public:
  // Closures, whitened at the start.
  LegProblem(const LegData& data, const Vector& start, WhitenedLeg whitened,
             const IdentificationOptions& options, LegRoom& room)
      : data_(data), options_(options), in_readings_(false), room_(room) {
    now_.parameters = start;
    now_.leg = std::move(whitened);
  }
  // g - psi
  LegProblem(const LegData& data, const Vector& start, const IdentificationOptions& options,
             LegRoom& room)
      : data_(data), options_(options), in_readings_(true), room_(room) {
    now_.parameters = start;
    linearise_in_readings();
  }

  Index size() const { return static_cast<Index>(data_.estimated.size()); }

  bool linearise(NormalEquations& equations) {
    if (moved_) {
      in_readings_ ? linearise_in_readings()
                   : whiten(data_, now_.parameters, options_.noise, now_.leg);
    }
    const Vector& raw = errors();
    residuals_ = raw.cwiseProduct(now_.leg.factors);
    now_.spread = options_.loss.spread(residuals_);
    equations.cost = weigh(now_.spread, now_.weights);
    squares_ = now_.weights.cwiseProduct(now_.leg.factors.cwiseAbs2());
    const RowMatrix& by_parameters = now_.leg.rows.by_parameters;
    weighted_square(by_parameters, squares_, raw, equations.information, equations.gradient);
    equations.by_new_weights = 0;
    if (moved_) {
      residuals_ = raw.cwiseProduct(former_.leg.factors);
      equations.by_new_weights = equations.cost - weigh(former_.spread, unused_);
    }
    return std::isfinite(equations.cost) && equations.gradient.allFinite();
  }

  void step(const Vector& d) {
    std::swap(now_, former_);
    now_.parameters = former_.parameters;
    now_.parameters(data_.estimated) += d;
    moved_ = true;
  }
  void undo() { std::swap(now_, former_); }
  bool still() const { return true; }
  double extent(const Vector& d) const { return relative_step(data_, now_.parameters, d); }
  bool orthogonal_step(Vector& d) const {
    const Vector roots = squares_.cwiseSqrt();
    d = -least_squares(roots.asDiagonal() * now_.leg.rows.by_parameters,
                       roots.cwiseProduct(errors()));
    return true;
  }

  // Where the solver ended.
  const Vector& errors() const { return now_.leg.rows.closure; }
  LegEstimate take(SolverOutcome outcome) {
    return {std::move(now_.parameters), std::move(outcome), std::move(now_.weights),
            std::move(now_.leg)};
  }

 private:
  void linearise_in_readings() {
    linearise_readings(data_, now_.parameters, now_.leg.rows);
    // One factor for all poses, so that the loss counts in standard deviations and the cost stays
    // the paper's.
    if (!moved_ || options_.loss.kind != RobustLoss::Kind::none) {
      deviation_ = reading_deviation(data_, now_.parameters, options_.noise);
    }
    now_.leg.factors.setConstant(data_.readings.size(), 1 / deviation_);
  }

  // The cost of the residuals and their weights.
  double weigh(double spread, Vector& weights) const {
    weights.setOnes(residuals_.size());
    if (options_.loss.kind == RobustLoss::Kind::none) {
      return residuals_.squaredNorm();
    }
    // Of a pose, all of whose closures are spoiled with it.
    const Index closures = in_readings_ ? 1 : data_.model.info().closures;
    const double bend = spread * std::sqrt(static_cast<double>(closures));
    double cost = 0;
    for (Index k = 0; k < residuals_.size(); k += closures) {
      const RobustLoss::Value value =
          options_.loss.evaluate(residuals_.segment(k, closures).squaredNorm(), bend);
      cost += value.cost;
      weights.segment(k, closures).setConstant(value.weight);
    }
    return cost;
  }

  const LegData& data_;
  const IdentificationOptions& options_;
  bool in_readings_;
  bool moved_ = false;
  double deviation_ = 1;
  LegRoom& room_;
  LegRoom::State &now_ = room_.now, &former_ = room_.former;
  Vector &residuals_ = room_.residuals, &squares_ = room_.squares, &unused_ = room_.unused;
};

SolverOutcome solve(LegProblem& problem, const IdentificationOptions& options, LegRoom& room) {
  const int steps = options.loss.kind == RobustLoss::Kind::none
                        ? options.max_iterations
                        : kRobustSteps * options.max_iterations;
  SolverOptions how{steps, kFirstDamping};
  if (options.estimator == Estimator::joint && options.loss.kind == RobustLoss::Kind::none) {
    how.enough = kJointStart;
  }
  return minimise(problem, how, room.solver);
}

// L D L' = V, the covariance of the closures at each pose: rows become L^-1 of what they were, and
// D is returned.
Vector decorrelate(ClosureRows& rows, Index closures, PoseSpace space,
                   const MeasurementNoise& noise) {
  const Vector sigma = noise.pose_variances(space);
  const double reading = noise.reading * noise.reading;
  Vector variances(rows.by_reading.size());
  for (Index first = 0; first < variances.size(); first += closures) {
    for (Index row = first; row < first + closures; ++row) {
      // Those before it are independent already.
      for (Index before = first; before < row; ++before) {
        const double shared =
            rows.by_pose.row(row).cwiseProduct(rows.by_pose.row(before)).dot(sigma.transpose()) +
            reading * rows.by_reading[row] * rows.by_reading[before];
        const double share = variances[before] > 0 ? shared / variances[before] : 0;
        rows.closure[row] -= share * rows.closure[before];
        rows.by_parameters.row(row) -= share * rows.by_parameters.row(before);
        rows.by_pose.row(row) -= share * rows.by_pose.row(before);
        rows.by_reading[row] -= share * rows.by_reading[before];
      }
      variances[row] = rows.by_pose.row(row).cwiseAbs2().dot(sigma.transpose()) +
                       reading * rows.by_reading[row] * rows.by_reading[row];
    }
  }
  return variances;
}

}  // namespace

void whiten(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
            WhitenedLeg& leg) {
  data.model.linearise(parameters, data.poses, data.readings, leg.rows);
  keep_estimated(data, leg.rows);
  const ChainInfo& chain = data.model.info();
  if (chain.closures == 1) {
    closure_variances(leg.rows, chain.pose_space, noise, leg.variances);
  } else {
    leg.variances = decorrelate(leg.rows, chain.closures, chain.pose_space, noise);
  }
  leg.factors = leg.variances.cwiseSqrt().cwiseInverse();
}

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
      break;
    }
    // Eq. 25, by QR rather than by the inverse of C'C. Its sign: with errors g - psi the update
    // of Eq. 26 must be subtracted.
    const Vector step = least_squares(rows.by_parameters, rows.closure);
    estimate.parameters(data.estimated) -= step;
    if (relative_step(data, estimate.parameters, step) < 1e-11) {
      outcome.converged = true;
      break;
    }
  }
  if (!outcome.converged && outcome.failure.empty()) {
    outcome.failure = "no convergence in " + std::to_string(options.max_iterations) + " iterations";
  }
  whiten(data, estimate.parameters, options.noise, estimate.whitened);
  return estimate;
}

LegEstimate estimate_inverse(const LegData& data, const Vector& start,
                             const IdentificationOptions& options, LegRoom& room) {
  LegProblem problem(data, start, options, room);
  SolverOutcome outcome = solve(problem, options, room);
  if (!problem.errors().allFinite()) {
    outcome.failure = unreached_pose(problem.errors()) + " is out of the leg's reach at the start";
  }
  LegEstimate estimate = problem.take(std::move(outcome));
  whiten(data, estimate.parameters, options.noise, estimate.whitened);
  return estimate;
}

LegEstimate estimate_implicit(const LegData& data, const Vector& start, WhitenedLeg whitened,
                              const IdentificationOptions& options, LegRoom& room) {
  LegProblem problem(data, start, std::move(whitened), options, room);
  return problem.take(solve(problem, options, room));
}

}  // namespace symkin
