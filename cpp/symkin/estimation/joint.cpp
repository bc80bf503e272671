// SPDX-License-Identifier: MIT
#include "symkin/estimation/joint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/detail/pose_recovery.hpp"
#include "symkin/estimation/detail/robust_fit.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// The rows of all poses, weighted by the loss, and below them those of the priors.
RowMatrix stacked_rows(const LatentProblem& problem, const Vector& priors) {
  std::vector<RowMatrix> poses;
  Index count = 0;
  for (std::size_t k = 0; k < problem.counts().size(); ++k) {
    const auto pose = static_cast<Index>(k);
    poses.push_back(std::sqrt(problem.weights()[pose]) * problem.as_eliminated(pose).jacobian);
    count += poses.back().rows();
  }
  const Index columns = priors.size();
  RowMatrix rows = RowMatrix::Zero(count + columns, columns);
  Index first = 0;
  for (const RowMatrix& pose : poses) {
    rows.middleRows(first, pose.rows()) = pose;
    first += pose.rows();
  }
  rows.bottomRows(columns).diagonal() = priors.cwiseInverse();
  return rows;
}

// Whether squaring the rows into an information matrix has cost half of the digits at most; else
// they have to be asked.
constexpr double kLeastPivot = 1e-6;
bool well_determined(const RowMatrix& information, ScaledCholesky& cholesky) {
  cholesky.compute(information);
  return information.size() > 0 && cholesky.least_pivot() > kLeastPivot;
}

// What rows do not show, see null_space(), from their square where that shows it clearly.
std::optional<RowMatrix> clearly_unseen(const RowMatrix& information, const Vector& scale) {
  std::optional<RowMatrix> null = clear_null_space(information, kLeastPivot);
  if (!null || null->cols() == 0) {
    return null;
  }
  return column_space(scale.cwiseInverse().asDiagonal() * *null).basis;
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

// The covariance of the solution that obeys the rows A z = 0 exactly, from any that obeys them. By
// orthogonal factors: rows that hold what nothing shows make the normal equations too coarse.
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

// Statistics of the rows of one pose, for estimates of this covariance of the columns.
void add_rows(Index index, const LinearPose& pose, const RowMatrix& covariance,
              std::vector<RowFit>& rows) {
  constexpr double kSilent = 1e-9;  // of the row's own variance
  const RowMatrix& e = pose.elimination.conditions;
  // J C J' by the rows' own unknowns, which are few.
  const Index m = pose.by_unknowns.rows();
  RowMatrix of_rows = RowMatrix::Zero(m, m);
  Vector along(covariance.cols());
  for (Index k = 0; k < m; ++k) {
    along.setZero();
    for (Index i = 0; i < along.size(); ++i) {
      const double derivative = pose.by_unknowns(k, i);
      if (derivative != 0) {
        along += derivative * covariance.row(i).transpose();
      }
    }
    for (Index l = 0; l <= k; ++l) {
      of_rows(k, l) = of_rows(l, k) = pose.by_unknowns.row(l).dot(along);
    }
  }
  const RowMatrix explained = product(product(e.transpose(), of_rows), e);
  for (Index k = 0; k < pose.variances.size(); ++k) {
    const RowOrigin& origin = pose.origins[static_cast<std::size_t>(k)];
    if (origin.kind == RowOrigin::Kind::closure && origin.by_error == 0) {
      continue;  // of a leg's bond, which is not observed
    }
    const double multiplier = e.row(k).dot(pose.conditions);
    const double all = e.row(k).squaredNorm();
    const double variance = all - e.row(k) * explained * e.row(k).transpose();
    const bool reading = origin.kind == RowOrigin::Kind::closure;
    const double unit = reading && origin.by_error != 0 ? origin.by_error : 1;
    RowFit row{index,        static_cast<int>(origin.kind),
               origin.index, -pose.variances[k] * multiplier / unit,
               kMissing,     kMissing};
    if (e.cols() > 0 && variance > kSilent * all) {
      row.t = -multiplier / std::sqrt(variance) * (unit < 0 ? -1 : 1);
      row.blunder = multiplier / variance / unit;
    }
    rows.push_back(row);
  }
}

// Chi-square of a fit of this rank, and what its errors follow. Returns the factor of the inverse
// of the (weighted) information of the data.
double judge(Index rank, Index priors, BlockLosses& losses, JointFit& fit) {
  std::vector<Index> legs(static_cast<std::size_t>(fit.setup.parameters.rows()));
  std::iota(legs.begin(), legs.end(), Index{0});
  if (losses.any()) {
    const RobustStatistics robust = robust_statistics(fit.chi_squares, fit.conditions, rank, losses,
                                                      {}, priors, fit.chi_square_prior);
    fit.goodness = judged(std::move(legs), robust.chi_square, robust.degrees_of_freedom);
    fit.student_degrees = robust.student_degrees;
    return robust.variance;
  }
  const Index conditions = std::accumulate(fit.conditions.begin(), fit.conditions.end(), Index{0});
  fit.goodness = judged(std::move(legs), fit.chi_square_data + fit.chi_square_prior,
                        static_cast<double>(conditions + priors - rank));
  return fit.goodness.spread() * fit.goodness.spread();
}

// What is said of ranks and covariances at the problem's present state.
void determine(const LatentProblem& problem, const RowMatrix& information, const Layout& layout,
               const Vector& tolerances, const Vector& scale, BlockLosses& losses, JointFit& fit) {
  RowMatrix& unscaled = fit.model_covariance;
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
    const std::optional<RowMatrix> unseen =
        priors == 0 ? std::optional(RowMatrix(columns, 0)) : clearly_unseen(data, scale);
    if (unseen) {
      fit.rank = columns;
      fit.data_rank = columns - unseen->cols();
      fit.unseen = unseen->cols() > 0 ? named_directions(*unseen, Vector::Ones(columns)) : *unseen;
      const double factor = judge(fit.rank, priors, losses, fit);
      if (factor == 1) {
        fit.covariance = unscaled;
        return;
      }
      data /= factor;
      data.diagonal() += precisions;
      if (well_determined(data, cholesky)) {
        fit.covariance = cholesky.inverse();
        return;
      }
    }
  }
  const RowMatrix rows = stacked_rows(problem, layout.prior);
  const Index of_data = rows.rows() - columns;
  const NullSpace of_data_alone = null_space(rows.topRows(of_data), scale);
  const NullSpace of_all = null_space(rows, scale);
  fit.data_rank = of_data_alone.rank();
  fit.rank = of_all.rank();
  fit.unseen = of_data_alone.directions.cols() > 0
                   ? named_directions(of_data_alone.directions, Vector::Ones(columns))
                   : of_data_alone.directions;
  fit.gauge_directions = of_all.directions.cols();
  const double factor = judge(fit.rank, priors, losses, fit);

  // What no row shows is held by rows of its own, and taken out again.
  const RowMatrix held = nearest_to_start(of_all.directions, tolerances, scale);
  RowMatrix full(rows.rows() + held.rows(), columns);
  full << rows, held;
  const auto projected = [&](RowMatrix covariance) {
    if (held.rows() > 0) {
      const RowMatrix n = scale.asDiagonal() * of_all.directions;
      const RowMatrix onto = RowMatrix::Identity(columns, columns) -
                             product(product(n, inverse(product(held, n))), held);
      covariance = product(product(onto, covariance), onto.transpose());
    }
    return covariance;
  };
  fit.covariance = unscaled = projected(inverse_of(full, scale));
  if (factor != 1) {
    full.topRows(of_data) /= std::sqrt(factor);
    fit.covariance = projected(inverse_of(full, scale));
  }
}

// Everything that is said of the fit at the problem's present state.
void describe(const LatentProblem& problem, const RowMatrix& information, const Layout& layout,
              const Vector& tolerances, const Vector& scale, BlockLosses& losses, bool rows,
              JointFit& fit) {
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
  determine(problem, information, layout, tolerances, scale, losses, fit);
  for (Index pose = 0; rows && pose < fit.poses.rows(); ++pose) {
    if (!problem.aside()[static_cast<std::size_t>(pose)]) {
      add_rows(pose, problem.as_eliminated(pose), fit.model_covariance, fit.rows);
    }
  }
}

// The problem as fit_robustly() takes it: each fit comes to rest in passes, which hold what nothing
// shows and take in the poses that were set aside.
class JointSolver {
 public:
  JointSolver(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
              const JointOptions& options, Vector scale, LatentProblem problem)
      : mechanism_(&mechanism),
        observations_(&observations),
        layout_(&layout),
        options_(&options),
        scale_(std::move(scale)),
        problem_(std::make_unique<LatentProblem>(std::move(problem))),
        held_(0, layout.columns()) {}
  JointSolver(const JointSolver& other)
      : mechanism_(other.mechanism_),
        observations_(other.observations_),
        layout_(other.layout_),
        options_(other.options_),
        scale_(other.scale_),
        problem_(std::make_unique<LatentProblem>(*other.problem_)),
        held_(other.held_),
        open_(other.open_),
        outcome_(other.outcome_),
        cost_(other.cost_) {}
  JointSolver(JointSolver&&) noexcept = default;
  JointSolver& operator=(JointSolver&&) noexcept = default;
  JointSolver& operator=(const JointSolver&) = delete;
  ~JointSolver() = default;

  void solve(const BlockLosses& losses);

  const LatentProblem& problem() const { return *problem_; }
  const SolverOutcome& outcome() const { return outcome_; }
  bool converged() const { return outcome_.converged; }
  double cost() const { return cost_; }
  void move(const Vector& change) { problem_->step(change); }
  ConditionBlocks blocks() const;
  std::vector<Index> guard(const ConditionBlocks& blocks) const;

 private:
  // Whether there are directions that nothing shows; holds them.
  bool hold_unseen();

  const Mechanism* mechanism_;
  const Observations* observations_;
  const Layout* layout_;
  const JointOptions* options_;
  Vector scale_;
  std::unique_ptr<LatentProblem> problem_;
  RowMatrix held_;
  bool open_ = false;  // whether `held_` holds anything
  SolverOutcome outcome_;
  double cost_ = 0;
};

bool JointSolver::hold_unseen() {
  ScaledCholesky cholesky;
  if (well_determined(problem_->information(), cholesky)) {
    return false;
  }
  if (options_->gauge == Gauge::refuse) {
    const auto unseen = clearly_unseen(problem_->information(), scale_);
    if (unseen && unseen->cols() > 0) {
      refuse(*unseen, scale_);
    }
  }
  const NullSpace null = null_space(stacked_rows(*problem_, layout_->prior), scale_);
  const bool open = null.directions.cols() > 0;
  if (open && options_->gauge == Gauge::refuse) {
    refuse(null.directions, scale_);
  }
  held_ = nearest_to_start(null.directions, tolerances_of(*layout_, *options_), scale_);
  problem_->constrain(held_);
  return open;
}

void JointSolver::solve(const BlockLosses& losses) {
  constexpr int kMaxPasses = 20;
  constexpr double kNothing = 1e-13;  // a pivot of a diagonal of ones
  constexpr double kStill = 1e-9;     // of the columns, in their typical sizes
  constexpr int kRobustSteps = 5;     // times those without a loss, whose weights settle afterwards
  problem_->set_losses(losses);
  SolverWorkspace room;
  // Frames and a gauge are hardly ever seen in full: a fit that is free to go along what nothing
  // shows would go far.
  if (options_->gauge != Gauge::refuse && problem_->information().size() == 0) {
    NormalEquations at_start;
    open_ = problem_->linearise(at_start) && hold_unseen();
  }
  Vector before = problem_->change();
  for (int pass = 0;; ++pass) {
    SolverOptions solver{(losses.any() ? kRobustSteps : 1) * options_->max_iterations};
    if (problem_->starts_near()) {
      solver.damping = 0;  // two steps less
    }
    // What is refused in the end is refused at once.
    solver.least_pivot = options_->gauge == Gauge::refuse && pass == 0 ? kNothing : -1;
    const int iterations = outcome_.iterations;
    outcome_ = minimise(*problem_, solver, room);
    if (outcome_.undetermined) {
      hold_unseen();  // unless what the square does not show is there after all
      solver.least_pivot = -1;
      outcome_ = minimise(*problem_, solver, room);
    }
    outcome_.iterations += iterations;
    cost_ = room.now.cost;
    if (problem_->information().size() == 0) {
      throw InvalidInput(
          "the observations cannot be explained at the start: a residual is not finite");
    }
    const bool held = open_;  // while it was fitted
    open_ = hold_unseen();
    if (!outcome_.converged) {
      return;
    }
    const double change =
        (problem_->change() - before).cwiseQuotient(scale_).lpNorm<Eigen::Infinity>();
    before = problem_->change();
    if (open_ && ((pass == 0 && !held) || change > kStill)) {
      if (pass == kMaxPasses) {
        outcome_.converged = false;
        outcome_.failure = "what nothing shows still moves the estimate";
        return;
      }
      continue;
    }
    if (take_in(*mechanism_, *observations_, *problem_) == 0) {
      return;
    }
  }
}

ConditionBlocks JointSolver::blocks() const {
  ConditionBlocks blocks;
  std::vector<LinearPose> poses;
  for (std::size_t k = 0; k < problem_->counts().size(); ++k) {
    LinearPose pose = problem_->linear(static_cast<Index>(k));
    if (pose.count() > 0) {
      poses.push_back(std::move(pose));
      blocks.first.push_back(blocks.rows() + poses.back().count());
    }
  }
  std::vector<Index> with_prior;
  for (Index i = 0; i < layout_->columns(); ++i) {
    if (std::isfinite(layout_->prior[i])) {
      with_prior.push_back(i);
    }
  }
  const auto priors = static_cast<Index>(with_prior.size());
  blocks.jacobian.setZero(blocks.rows() + priors + held_.rows(), layout_->columns());
  blocks.residual.setZero(blocks.jacobian.rows());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    blocks.jacobian.middleRows(blocks.first[k], poses[k].count()) = poses[k].jacobian;
    blocks.residual.segment(blocks.first[k], poses[k].count()) = poses[k].conditions;
  }
  for (Index i = 0; i < priors; ++i) {
    const Index column = with_prior[static_cast<std::size_t>(i)];
    blocks.jacobian(blocks.rows() + i, column) = 1 / layout_->prior[column];
    blocks.residual[blocks.rows() + i] = problem_->change()[column] / layout_->prior[column];
  }
  blocks.jacobian.bottomRows(held_.rows()) = held_;
  blocks.residual.tail(held_.rows()) = held_ * problem_->change();
  return blocks;
}

std::vector<Index> JointSolver::guard(const ConditionBlocks& blocks) const {
  std::vector<Index> poses;
  for (std::size_t k = 0; k < problem_->counts().size(); ++k) {
    if (problem_->counts()[k] > 0) {
      poses.push_back(static_cast<Index>(k));
    }
  }
  return unguarded(blocks, options_->loss, "the fit", poses);
}

}  // namespace

JointFit fit_jointly(const Mechanism& mechanism, const Setup& start,
                     const Observations& observations, const Layout& layout,
                     const JointOptions& options) {
  observations.check(mechanism, start);
  layout.check(mechanism, start);
  check_options(mechanism, observations, layout, options);

  std::vector<bool> aside;
  RowMatrix poses = options.start;
  for (Index i = 0; i < poses.rows(); ++i) {
    aside.push_back(!poses.row(i).allFinite() || !observations.any(i));
    if (aside.back()) {
      poses.row(i) = identity_pose(mechanism.pose_space());
    }
  }
  const Vector scale = typical_sizes(mechanism, start, layout, options);
  JointSolver solver(mechanism, observations, layout, options, scale,
                     {mechanism, observations, layout, start, std::move(poses), std::move(aside)});
  auto [losses, unguarded] = fit_robustly(solver, options.loss);
  JointFit fit;
  fit.converged = solver.outcome().converged;
  fit.failure = solver.outcome().failure;
  fit.iterations = solver.outcome().iterations;
  fit.unguarded = std::move(unguarded);
  const LatentProblem& problem = solver.problem();
  describe(problem, problem.information(), layout, tolerances_of(layout, options), scale, losses,
           options.rows, fit);
  return fit;
}

}  // namespace symkin
