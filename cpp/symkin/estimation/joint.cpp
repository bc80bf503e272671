// SPDX-License-Identifier: MIT
#include "symkin/estimation/joint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/detail/set_aside.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

std::vector<LinearPose> linear_poses(const LatentProblem& problem) {
  std::vector<LinearPose> poses;
  for (std::size_t k = 0; k < problem.counts().size(); ++k) {
    poses.push_back(problem.linear(static_cast<Index>(k)));
  }
  return poses;
}

// The rows of all poses, weighted by the loss, and below them those of the priors.
RowMatrix stacked_rows(const std::vector<LinearPose>& poses, const Vector& weights,
                       const Vector& priors) {
  Index count = 0;
  for (const LinearPose& pose : poses) {
    count += pose.count();
  }
  const Index columns = priors.size();
  RowMatrix rows = RowMatrix::Zero(count + columns, columns);
  Index first = 0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Index n = poses[k].count();
    rows.middleRows(first, n) = std::sqrt(weights[static_cast<Index>(k)]) * poses[k].jacobian;
    first += n;
  }
  rows.bottomRows(columns).diagonal() = priors.cwiseInverse();
  return rows;
}

// Whether squaring the rows into an information matrix has cost half of the digits at most; else
// they have to be asked.
bool well_determined(const RowMatrix& information, ScaledCholesky& cholesky) {
  constexpr double kLeastPivot = 1e-6;
  cholesky.compute(information);
  return information.size() > 0 && cholesky.least_pivot() > kLeastPivot;
}

// What rows (m x p) do not show, as directions of columns in `scale`, and their rank.
struct Sight {
  Index rank;
  RowMatrix unseen;  // p x (p - rank), in scale
};

Sight sight_of(const RowMatrix& rows, const Vector& scale) {
  constexpr double kRank = 1e-9;
  const Index p = rows.cols();
  RowMatrix tall = RowMatrix::Zero(std::max(rows.rows(), p), p);
  tall.topRows(rows.rows()) = rows * scale.asDiagonal();
  const RightSingular svd = right_singular(triangular_factor(tall));
  const Index rank =
      svd.values.size() == 0 ? 0 : (svd.values.array() > kRank * svd.values[0]).count();
  return {rank, svd.vectors.rightCols(p - rank)};
}

// Rows A with A z = 0 for what is nearest to the start among z + N a: N' W z = 0. `unseen` is in
// `scale`, and so is the result once a row is divided by it.
RowMatrix nearest_to_start(const RowMatrix& unseen, const Vector& tolerances, const Vector& scale) {
  // In z / scale: W = 1 / tolerance^2 becomes (scale / tolerance)^2, one or, without tolerance,
  // next to nothing: a direction of frames alone has to be held somehow.
  constexpr double kFree = 1e-6;
  Vector weights(scale.size());
  for (Index i = 0; i < scale.size(); ++i) {
    weights[i] = tolerances[i] > 0 ? 1 : kFree * kFree;
  }
  return unseen.transpose() * weights.asDiagonal() * scale.cwiseInverse().asDiagonal();
}

// The covariance of the solution that obeys the rows A z = 0 exactly, from any that obeys them.
RowMatrix inverse_of(const RowMatrix& rows, const Vector& scale) {
  const RowMatrix scaled = rows * scale.asDiagonal();
  const Vector lengths = inverse_column_lengths(scaled);
  const RowMatrix factor = triangular_factor(scaled * lengths.asDiagonal());
  const RowMatrix half =
      scale.cwiseProduct(lengths).asDiagonal() * lower_inverse(factor.transpose()).transpose();
  return product(half, half.transpose());
}

Vector typical_sizes(const Mechanism& mechanism, const Setup& start, const Layout& layout,
                     const JointOptions& options) {
  constexpr double kFrame = 1e-3;  // of the natural size, where nothing is known
  const Vector natural = natural_sizes(mechanism, start);
  Vector sizes = Vector::Zero(layout.columns());
  for (Index i = 0; i < natural.size(); ++i) {
    const Index column = layout.column[static_cast<std::size_t>(i)];
    if (column >= 0) {
      sizes[column] = std::max(sizes[column], kFrame * natural[i]);
    }
  }
  for (Index i = 0; i < layout.columns(); ++i) {
    if (i < options.tolerances.size() && options.tolerances[i] > 0) {
      sizes[i] = options.tolerances[i];
    } else if (std::isfinite(layout.prior[i])) {
      sizes[i] = layout.prior[i];
    }
  }
  return sizes;
}

Vector tolerances_of(const Layout& layout, const JointOptions& options) {
  return options.tolerances.size() == 0 ? Vector(Vector::Zero(layout.columns()))
                                        : options.tolerances;
}

void check_options(const Mechanism& mechanism, const Observations& observations,
                   const Layout& layout, const JointOptions& options) {
  options.loss.check();
  if (options.tolerances.size() != 0 && options.tolerances.size() != layout.columns()) {
    throw InvalidInput("there are " + std::to_string(options.tolerances.size()) +
                       " tolerances; expected one a column, " + std::to_string(layout.columns()));
  }
  if (options.start.rows() != observations.count() ||
      options.start.cols() != coordinate_count(mechanism.pose_space())) {
    throw InvalidInput("the poses to start from are " + std::to_string(options.start.rows()) +
                       " x " + std::to_string(options.start.cols()) + "; expected " +
                       std::to_string(observations.count()) + " x " +
                       std::to_string(coordinate_count(mechanism.pose_space())));
  }
}

[[noreturn]] void refuse(const RowMatrix& unseen, const Vector& scale) {
  throw NotIdentifiable("the observations do not show all of the " + std::to_string(scale.size()) +
                            " unknowns, and no prior holds the rest",
                        named_directions(unseen, scale));
}

// How much larger than standard normal the conditions are.
double spread_of(const RobustLoss& loss, const LatentProblem& problem) {
  std::vector<double> all;
  for (const LinearPose& pose : linear_poses(problem)) {
    all.insert(all.end(), pose.conditions.data(), pose.conditions.data() + pose.count());
  }
  return all.empty()
             ? 1
             : loss.spread(Eigen::Map<const Vector>(all.data(), static_cast<Index>(all.size())));
}

// Statistics of the rows of one pose.
void add_rows(Index index, const PoseRows& pose, std::vector<RowFit>& rows) {
  constexpr double kSilent = 1e-9;  // of the row's own variance
  const RowMatrix& e = pose.conditions;
  for (Index k = 0; k < pose.variances.size(); ++k) {
    const RowOrigin& origin = pose.origins[static_cast<std::size_t>(k)];
    if (origin.kind == RowOrigin::Kind::closure && origin.by_error == 0) {
      continue;  // of a leg's bond, which is not observed
    }
    const double multiplier = e.row(k) * pose.multipliers;
    const double all = e.row(k) * pose.precision * e.row(k).transpose();
    const double variance = e.row(k) * pose.left * e.row(k).transpose();
    const bool reading = origin.kind == RowOrigin::Kind::closure;
    const double unit = reading && origin.by_error != 0 ? origin.by_error : 1;
    RowFit row{index,        static_cast<int>(origin.kind),
               origin.index, -pose.variances[k] * multiplier / unit,
               kMissing,     kMissing};
    if (e.cols() > 0 && variance > kSilent * all) {
      row.t = -multiplier / std::sqrt(variance) * (unit < 0 ? -1 : 1);
      row.blunder = multiplier / all / unit;
    }
    rows.push_back(row);
  }
}

GoodnessOfFit goodness_of(const JointFit& fit, Index rank, Index priors) {
  std::vector<Index> legs(static_cast<std::size_t>(fit.setup.parameters.rows()));
  std::iota(legs.begin(), legs.end(), Index{0});
  double chi_square = fit.chi_square_prior;
  Index degrees_of_freedom = priors - rank;
  for (std::size_t k = 0; k < fit.conditions.size(); ++k) {
    if (fit.loss_weights[static_cast<Index>(k)] >= kRejectedWeight) {
      chi_square += fit.chi_squares[static_cast<Index>(k)];
      degrees_of_freedom += fit.conditions[k];
    }
  }
  return judged(std::move(legs), chi_square, degrees_of_freedom);
}

// What is said of ranks and covariances at the problem's present state.
void determine(const LatentProblem& problem, const RowMatrix& information, const Layout& layout,
               const Vector& tolerances, const Vector& scale, JointFit& fit, RowMatrix& unscaled) {
  const Index columns = layout.columns();
  const Vector precisions = layout.prior.cwiseAbs2().cwiseInverse();
  Index priors = 0;
  for (const double precision : precisions) {
    priors += precision > 0 ? 1 : 0;
  }
  RowMatrix data = information;
  data.diagonal() -= precisions;
  ScaledCholesky cholesky;
  if (well_determined(information, cholesky)) {
    unscaled = cholesky.inverse();
    if (priors == 0 || well_determined(data, cholesky)) {
      fit.rank = fit.data_rank = columns;
      fit.unseen.resize(columns, 0);
      fit.goodness = goodness_of(fit, fit.rank, priors);
      const double spread = fit.goodness.spread();
      if (spread == 1) {
        fit.covariance = unscaled;
        return;
      }
      data /= spread * spread;
      data.diagonal() += precisions;
      if (well_determined(data, cholesky)) {
        fit.covariance = cholesky.inverse();
        return;
      }
    }
  }
  const RowMatrix rows = stacked_rows(linear_poses(problem), problem.weights(), layout.prior);
  const Index of_data = rows.rows() - columns;
  const Sight data_sight = sight_of(rows.topRows(of_data), scale);
  const Sight all_sight = sight_of(rows, scale);
  fit.data_rank = data_sight.rank;
  fit.rank = all_sight.rank;
  fit.unseen = data_sight.unseen.cols() > 0
                   ? named_directions(data_sight.unseen, Vector::Ones(columns))
                   : data_sight.unseen;
  fit.gauge_directions = all_sight.unseen.cols();
  fit.goodness = goodness_of(fit, fit.rank, priors);

  // What no row shows is held by rows of its own, and taken out again.
  const RowMatrix held = nearest_to_start(all_sight.unseen, tolerances, scale);
  RowMatrix full(rows.rows() + held.rows(), columns);
  full << rows, held;
  const auto projected = [&](RowMatrix covariance) {
    if (held.rows() > 0) {
      const RowMatrix n = scale.asDiagonal() * all_sight.unseen;
      const RowMatrix onto = RowMatrix::Identity(columns, columns) -
                             product(product(n, inverse(product(held, n))), held);
      covariance = product(product(onto, covariance), onto.transpose());
    }
    return covariance;
  };
  fit.covariance = unscaled = projected(inverse_of(full, scale));
  const double spread = fit.goodness.spread();
  if (spread > 1) {
    full.topRows(of_data) /= spread;
    fit.covariance = projected(inverse_of(full, scale));
  }
}

// Everything that is said of the fit at the problem's present state.
void describe(const LatentProblem& problem, const RowMatrix& information, const Layout& layout,
              const Vector& tolerances, const Vector& scale, bool rows, JointFit& fit) {
  fit.setup = problem.setup();
  fit.change = problem.change();
  fit.poses = problem.poses();
  fit.reading_errors = problem.reading_errors();
  fit.conditions = problem.counts();
  fit.chi_squares = problem.chi_squares();
  fit.loss_weights = problem.weights();
  for (std::size_t k = 0; k < problem.aside().size(); ++k) {
    if (problem.aside()[k]) {
      fit.aside.push_back(static_cast<Index>(k));
      fit.poses.row(static_cast<Index>(k)).setConstant(kMissing);
    }
  }
  fit.chi_square_data = fit.chi_squares.sum();
  fit.chi_square_prior = fit.change.cwiseQuotient(layout.prior).squaredNorm();
  RowMatrix unscaled;
  determine(problem, information, layout, tolerances, scale, fit, unscaled);
  if (rows) {
    problem.each_rows(
        unscaled, [&](Index pose, const PoseRows& of_pose) { add_rows(pose, of_pose, fit.rows); });
  }
}

}  // namespace

JointFit fit_jointly(const Mechanism& mechanism, const Setup& start,
                     const Observations& observations, const Layout& layout,
                     const JointOptions& options) {
  constexpr int kMaxPasses = 20;
  constexpr double kStill = 1e-9;  // of the columns, in their typical sizes
  observations.check(mechanism, start);
  layout.check(mechanism, start);
  check_options(mechanism, observations, layout, options);
  const Vector scale = typical_sizes(mechanism, start, layout, options);
  const Vector tolerances = tolerances_of(layout, options);

  std::vector<bool> aside;
  RowMatrix poses = options.start;
  for (Index i = 0; i < poses.rows(); ++i) {
    aside.push_back(!poses.row(i).allFinite() || !observations.any(i));
    if (aside.back()) {
      poses.row(i) = identity_pose(mechanism.pose_space());
    }
  }
  const bool adapts = options.loss.kind != RobustLoss::Kind::none && options.loss_spread == 0;
  LatentProblem problem(mechanism, observations, layout, start, std::move(poses), std::move(aside),
                        options.loss, options.loss_spread > 0 ? options.loss_spread : 1);

  // Directions that nothing shows, as rows that hold them; said where there are any.
  ScaledCholesky cholesky;
  const auto holds = [&] {
    if (well_determined(problem.information(), cholesky)) {
      return false;
    }
    const Sight sight =
        sight_of(stacked_rows(linear_poses(problem), problem.weights(), layout.prior), scale);
    const bool open = sight.unseen.cols() > 0;
    if (open && options.gauge == Gauge::refuse) {
      refuse(sight.unseen, scale);
    }
    problem.constrain(nearest_to_start(sight.unseen, tolerances, scale));
    return open;
  };
  // Frames and a gauge are hardly ever seen in full: a fit that is free to go along what nothing
  // shows would go far.
  bool open = false;
  if (options.gauge != Gauge::refuse) {
    NormalEquations at_start;
    open = problem.linearise(at_start) && holds();
  }

  JointFit fit;
  SolverOutcome outcome;
  Vector before = problem.change();
  for (int pass = 0;; ++pass) {
    SolverOptions solver{options.max_iterations};
    if (problem.starts_near()) {
      solver.damping = 0;  // two steps less
    }
    outcome = minimise(problem, solver);
    fit.iterations += outcome.iterations;
    if (problem.information().size() == 0) {
      throw InvalidInput(
          "the observations cannot be explained at the start: a residual is not finite");
    }
    const bool held = open;  // while it was fitted
    open = holds();
    if (!outcome.converged) {
      break;
    }
    if (adapts) {
      problem.set_spread(spread_of(options.loss, problem));
    }
    const double change =
        (problem.change() - before).cwiseQuotient(scale).lpNorm<Eigen::Infinity>();
    before = problem.change();
    const bool again = adapts || (open && !held);
    if ((open || adapts) && ((pass == 0 && again) || change > kStill)) {
      if (pass == kMaxPasses) {
        outcome.converged = false;
        outcome.failure = "the weights still move the estimate";
        break;
      }
      continue;
    }
    if (take_in(mechanism, observations, problem) == 0) {
      break;
    }
  }
  fit.converged = outcome.converged;
  fit.failure = outcome.failure;
  describe(problem, problem.information(), layout, tolerances, scale, options.rows, fit);
  return fit;
}

}  // namespace symkin
