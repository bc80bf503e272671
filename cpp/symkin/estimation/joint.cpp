// SPDX-License-Identifier: MIT
#include "symkin/estimation/joint.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/detail/pose_recovery.hpp"
#include "symkin/estimation/detail/robust_fit.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// What the poses show, their variance so many times as large and weighted by the loss, and the
// priors with them if they are to count.
LinearFit shown_by(const LatentProblem& problem, const Layout& layout, const Vector& scale,
                   double factor = 1, bool with_priors = true, bool by_rows = false,
                   const ScaledCholesky* known = nullptr) {
  RowMatrix square = problem.information();
  if (factor != 1 || !with_priors) {
    const RowMatrix priors = problem.prior_information();
    square = (square - priors) / factor;
    if (with_priors) {
      square += priors;
    }
  }
  const auto rows = [&] {
    WhitenedSystem system = problem.system();
    Index block = 0;
    for (Index pose = 0; pose < problem.weights().size(); ++pose) {
      if (problem.counts()[static_cast<std::size_t>(pose)] > 0) {
        const Index first = system.first[static_cast<std::size_t>(block)];
        system.jacobian.middleRows(first, system.conditions(block++)) *=
            std::sqrt(problem.weights()[pose] / factor);
      }
    }
    const Index below = with_priors ? layout.prior_rows().rows() : 0;
    return RowMatrix(system.jacobian.topRows(system.rows() + below));
  };
  return {std::move(square), scale, rows, by_rows, known};
}

// How many directions of the columns the priors hold: they may say the same more than once.
Index prior_rank(const Layout& layout) {
  std::vector<Index> others;  // columns without a prior of their own
  for (Index i = 0; i < layout.columns(); ++i) {
    if (!std::isfinite(layout.prior[i])) {
      others.push_back(i);
    }
  }
  const Index own = layout.columns() - static_cast<Index>(others.size());
  if (layout.relations.rows() == 0 || others.empty()) {
    return own;
  }
  const RowMatrix rest = layout.relations(kAll, others);
  return own + LinearFit(rest, Vector::Ones(rest.rows())).rank();
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

// Throws where something is unseen.
void require_all(const LinearFit& shown) {
  if (shown.unseen().cols() > 0) {
    throw NotIdentifiable("the observations do not show all of the " +
                              std::to_string(shown.unseen().rows()) +
                              " unknowns, and no prior holds the rest",
                          shown.named_unseen());
  }
}

// Of each row of a pose: what of its multiplier's variance estimates of this covariance of the
// columns explain.
Vector explained_by(const LinearPose& pose, const RowMatrix& covariance) {
  const RowMatrix& e = pose.elimination.conditions;
  if (e.cols() > covariance.cols()) {
    const RowMatrix by_unknowns = product(e, pose.jacobian);
    return product(by_unknowns, covariance).cwiseProduct(by_unknowns).rowwise().sum();
  }
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
  return product(e, explained).cwiseProduct(e).rowwise().sum();
}

RowShares shares_of(const LinearPose& pose, const RowMatrix& covariance) {
  const RowMatrix& e = pose.elimination.conditions;
  return {e * pose.conditions, e.rowwise().squaredNorm(), explained_by(pose, covariance)};
}

// Statistics of the rows of one pose, or of a piece of a block. The estimate follows a row by this
// weight: one that is rejected is off by its own error and by that of the estimate, which has
// nothing of it. With a loss the estimates vary by more than those of least squares, which moves
// rows by this variance; else empty.
void add_rows(const LinearPose& pose, const RowShares& shares, double weight, const Vector& by_loss,
              std::vector<RowFit>& rows) {
  constexpr double kSilent = 1e-9;  // of the row's own variance
  for (Index k = 0; k < pose.variances.size(); ++k) {
    const RowOrigin& origin = pose.origins[static_cast<std::size_t>(k)];
    if (origin.kind == RowOrigin::Kind::closure && origin.by_error == 0) {
      continue;  // of a leg's bond, which is not observed
    }
    const double multiplier = shares.multipliers[k];
    const double all = shares.variances[k];
    const double explained = shares.explained[k];
    const double left = all - weight * explained;  // of what is off from where the others have it
    // A closure is to vanish at the reading less its error, and what is observed is to be the model
    // and its error.
    const bool reading = origin.kind == RowOrigin::Kind::closure;
    const double unit = reading && origin.by_error != 0 ? -origin.by_error : 1;
    RowFit row{origin.pose,  static_cast<int>(origin.kind),
               origin.index, -pose.variances[k] * multiplier / unit,
               kMissing,     kMissing};
    if (left > kSilent * all) {
      const double moved = by_loss.size() > 0 ? std::max(by_loss[k], 0.0) : 0;
      const double variance = left * (1 + (1 - weight) * explained / all) + moved;
      row.t = -multiplier / std::sqrt(variance) * (unit < 0 ? -1 : 1);
      row.blunder = -multiplier / left / unit;
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
                                                      priors, fit.chi_square_prior);
    fit.goodness = judged(std::move(legs), robust.chi_square, robust.degrees_of_freedom);
    fit.student_degrees = robust.student_degrees;
    return robust.variance;
  }
  const Index conditions = std::accumulate(fit.conditions.begin(), fit.conditions.end(), Index{0});
  fit.goodness = judged(std::move(legs), fit.chi_square_data + fit.chi_square_prior,
                        static_cast<double>(conditions + priors - rank));
  return fit.goodness.spread() * fit.goodness.spread();
}

// What is said of ranks and covariances at the problem's present state, of which `all` is shown.
void determine(const LatentProblem& problem, const LinearFit& all, const Layout& layout,
               const Vector& tolerances, const Vector& scale, BlockLosses& losses, JointFit& fit) {
  const Index columns = layout.columns();
  const Index priors = prior_rank(layout);
  RowMatrix unseen = all.unseen();
  if (priors > 0) {
    unseen = shown_by(problem, layout, scale, 1, false).unseen();
  }
  fit.rank = all.rank();
  fit.gauge_directions = columns - fit.rank;
  fit.data_rank = columns - unseen.cols();
  fit.unseen = unseen.cols() > 0 ? named_directions(unseen, Vector::Ones(columns)) : unseen;
  const double factor = judge(fit.rank, priors, losses, fit);
  const RowMatrix held = nearest_to_start(all.unseen(), tolerances, scale);
  fit.covariance = fit.model_covariance = all.covariance(held);
  if (factor != 1) {
    fit.covariance = shown_by(problem, layout, scale, factor).covariance(held);
  }
}

// Everything that is said of the fit at the problem's present state.
void describe(const LatentProblem& problem, const LinearFit& all, const Layout& layout,
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
  fit.chi_square_prior = problem.prior_squares();
  determine(problem, all, layout, tolerances, scale, losses, fit);
  RowMatrix by_loss;  // covariance
  if (losses.any()) {
    by_loss = fit.covariance - fit.model_covariance;
  }
  for (Index pose = 0; rows && pose < fit.poses.rows(); ++pose) {
    if (problem.aside()[static_cast<std::size_t>(pose)]) {
      continue;
    }
    const double weight = fit.loss_weights[pose];  // of a block at its first
    if (const LinearBlock* block = problem.block(pose)) {
      const std::vector<RowShares> shares = block->shares(fit.model_covariance);
      const std::vector<RowShares> moved =
          losses.any() ? block->shares(by_loss) : std::vector<RowShares>(shares.size());
      for (std::size_t k = 0; k < shares.size(); ++k) {
        add_rows(block->pieces()[k].rows, shares[k], weight, moved[k].explained, fit.rows);
      }
    } else if (problem.alone(pose)) {
      const LinearPose linear = problem.as_eliminated(pose);
      const Vector moved = losses.any() ? explained_by(linear, by_loss) : Vector();
      add_rows(linear, shares_of(linear, fit.model_covariance), weight, moved, fit.rows);
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
        problem_(std::make_unique<LatentProblem>(std::move(problem))) {}
  JointSolver(const JointSolver& other)
      : mechanism_(other.mechanism_),
        observations_(other.observations_),
        layout_(other.layout_),
        options_(other.options_),
        scale_(other.scale_),
        problem_(std::make_unique<LatentProblem>(*other.problem_)),
        open_(other.open_),
        shown_(other.shown_),
        outcome_(other.outcome_),
        cost_(other.cost_) {}
  JointSolver(JointSolver&&) noexcept = default;
  JointSolver& operator=(JointSolver&&) noexcept = default;
  JointSolver& operator=(const JointSolver&) = delete;
  ~JointSolver() = default;

  void solve(const BlockLosses& losses);

  const LatentProblem& problem() const { return *problem_; }
  // Where it ended.
  const LinearFit& shown() const { return shown_; }
  const SolverOutcome& outcome() const { return outcome_; }
  bool converged() const { return outcome_.converged; }
  double cost() const { return cost_; }
  void move(const Vector& change) { problem_->step(change); }
  WhitenedSystem system() const { return problem_->system(); }
  std::vector<Index> guard(const WhitenedSystem& system) const;

 private:
  bool look_at_start(SolverWorkspace& room);
  // Whether there are directions that nothing shows; holds them. The steps' decomposition of what
  // the problem shows, with what is held, may be known.
  bool hold_unseen(const ScaledCholesky* known);

  const Mechanism* mechanism_;
  const Observations* observations_;
  const Layout* layout_;
  const JointOptions* options_;
  Vector scale_;
  std::unique_ptr<LatentProblem> problem_;
  bool open_ = false;  // whether something is held
  LinearFit shown_;
  SolverOutcome outcome_;
  double cost_ = 0;
};

bool JointSolver::hold_unseen(const ScaledCholesky* known) {
  const bool refuse = options_->gauge == Gauge::refuse;
  shown_ = shown_by(*problem_, *layout_, scale_, 1, true, !refuse,
                    problem_->constrained() ? nullptr : known);
  if (refuse) {
    require_all(shown_);
  }
  problem_->constrain(
      nearest_to_start(shown_.unseen(), tolerances_of(*layout_, *options_), scale_));
  return shown_.unseen().cols() > 0;
}

// A fit that is free to go along what nothing shows would go far, and one that will be refused is
// never begun. What is hidden at the start alone, such as the angle of an offset without length, is
// not hidden a step away. Returns whether the problem is still as it was linearised.
bool JointSolver::look_at_start(SolverWorkspace& room) {
  constexpr double kNothing = 1e-13;  // a pivot of a diagonal of ones
  constexpr std::uint64_t kSeed = 4;
  if (!problem_->linearise(room.now)) {
    return false;
  }
  room.steps.decompose(room.now, 0);
  if (options_->gauge != Gauge::refuse) {
    open_ = hold_unseen(room.steps.undamped());
    return !open_;
  }
  if (room.steps.undamped()->least_pivot() > kNothing) {
    return true;
  }
  LatentProblem away = *problem_;
  Random random(kSeed);
  away.step(scale_.unaryExpr([&](double size) { return size * random.normal(); }));
  NormalEquations there;
  if (away.linearise(there)) {
    require_all(shown_by(away, *layout_, scale_));
  }
  return true;
}

void JointSolver::solve(const BlockLosses& losses) {
  constexpr int kMaxPasses = 20;
  constexpr double kStill = 1e-9;  // of the columns, in their typical sizes
  constexpr int kRobustSteps = 5;  // times those without a loss, whose weights settle afterwards
  problem_->set_losses(losses);
  SolverWorkspace room;
  SolverOptions solver{(losses.any() ? kRobustSteps : 1) * options_->max_iterations};
  // Who asks for estimates and deviations alone does without half of their digits.
  solver.last_step = options_->rows ? solver.last_step : 5e-6;
  solver.keeps_information = !options_->rows;
  solver.finishes = !options_->loss.any();
  if (problem_->information().size() == 0) {
    solver.linearised = look_at_start(room);
  }
  Vector before = problem_->change();
  for (int pass = 0;; ++pass) {
    if (problem_->starts_near()) {
      solver.damping = 0;  // two steps less
    }
    const int iterations = outcome_.iterations;
    outcome_ = minimise(*problem_, solver, room);
    solver.linearised = false;
    outcome_.iterations += iterations;
    cost_ = room.now.cost;
    if (problem_->information().size() == 0) {
      throw InvalidInput(
          "the observations cannot be explained at the start: a residual is not finite");
    }
    const bool held = open_;  // while it was fitted
    open_ = hold_unseen(outcome_.converged ? room.steps.undamped() : nullptr);
    if (!outcome_.converged) {
      return;
    }
    const double change =
        (problem_->change() - before).cwiseQuotient(scale_).lpNorm<Eigen::Infinity>();
    before = problem_->change();
    if (held != open_ || (open_ && change > kStill)) {
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

std::vector<Index> JointSolver::guard(const WhitenedSystem& system) const {
  std::vector<Index> poses;
  for (std::size_t k = 0; k < problem_->counts().size(); ++k) {
    if (problem_->counts()[k] > 0) {
      poses.push_back(static_cast<Index>(k));
    }
  }
  return unguarded(system, options_->loss, "the fit", poses);
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
  describe(problem, solver.shown(), layout, tolerances_of(layout, options), scale, losses,
           options.rows, fit);
  return fit;
}

}  // namespace symkin
