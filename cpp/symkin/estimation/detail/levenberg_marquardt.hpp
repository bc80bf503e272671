// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

struct SolverOutcome {
  bool converged = false;
  int iterations = 0;  // accepted steps
  std::string failure;
};

struct SolverOptions {
  int max_iterations = 100;  // steps tried
  double damping = 1e-4;     // of the first step; 0 begins as Gauss-Newton
  // Whether the room holds the equations of the present state already, decomposed by its steps.
  bool linearised = false;
  // Over the root of the cost: a step as short as this is the last, and nothing is linearised anew.
  double last_step = 1e-8;
  // Whether the step before that one keeps the information, where the gradient behind it says that
  // one more is the last.
  bool keeps_information = false;
  bool finishes = false;  // whether that one moves the parameters alone
};

// Weighted least squares linearised at the present state, residuals rho and weights W.
struct NormalEquations {
  RowMatrix information;  // J'W J, of which the lower triangle is read
  Vector gradient;        // J'W rho
  double cost = 0;        // what steps lower: d from here by -(2 d'gradient + d'Hd), predicted

  void reset(Index size) {
    information.setZero(size, size);
    gradient.setZero(size);
    cost = 0;
  }
};

// Steps from normal equations whose columns are brought to unit length, so that neither units nor
// the sizes of parameters matter.
class NormalSteps {
 public:
  // H + damping diag H.
  void decompose(const NormalEquations& equations, double damping);
  // The last of these, null where it was damped.
  const ScaledCholesky* undamped() const { return damping_ == 0 ? &cholesky_ : nullptr; }
  // (H + damping diag H) d = -gradient, of the equations that were decomposed. Without damping and
  // with poor pivots the shortest d by eigenvalues: what the data does not show does not move.
  // Returns the decrease of the cost that it predicts, negative if there is no step.
  double solve_decomposed(const NormalEquations& equations, Vector& step) const;
  double solve(const NormalEquations& equations, double damping, Vector& step) {
    decompose(equations, damping);
    return solve_decomposed(equations, step);
  }
  // The same by another gradient, with poor pivots none.
  double solve_again(const Vector& gradient, Vector& step) const;

 private:
  bool poor() const;  // pivots

  ScaledCholesky cholesky_;
  double damping_ = 0;
};

// What the solver needs beside the problem. Problem after problem in the same room asks for no
// memory.
struct SolverWorkspace {
  NormalEquations now, next;
  NormalSteps steps;
  Vector step;
};

namespace detail {

template <typename Problem, typename = void>
struct HasCorrect : std::false_type {};
template <typename Problem, typename = void>
struct HasGradient : std::false_type {};
template <typename Problem>
struct HasGradient<Problem, std::void_t<decltype(std::declval<Problem&>().linearise_gradient(
                                std::declval<NormalEquations&>()))>> : std::true_type {};

template <typename Problem>
struct HasCorrect<
    Problem, std::void_t<decltype(std::declval<Problem&>().correct(std::declval<const Vector&>()))>>
    : std::true_type {};

}  // namespace detail

// Minimises a nonlinear least-squares problem by Levenberg-Marquardt, to the last useful digit and
// silently. A problem has a state, of which the parameters may be a part, and
//   Index size() const;                     its parameters
//   bool linearise(NormalEquations&);       at the present state; false where that is not finite
//   void step(const Vector& d);             moves the state
//   void undo();                            takes the last step back, with all that depends on it
//   double step_size(const Vector& d) const;   how far a step goes, relative to the state: no unit
//   bool latents_at_rest() const;                     whether the last step left what the state
//   holds beside
//                                           the parameters where it was
// and may have
//   void correct(const Vector& d);          moves on from a step; `undo` takes back both
//   bool linearise_gradient(NormalEquations&);   as linearise() does, without the information, and
//   void finish(const Vector& d);   moves the parameters alone
// The problem ends as it was last linearised, at the state it ends at or, where it converged, at
// most one step too short to count from there, if `undo` keeps that too. `room` ends with those
// equations in `now`; where it converged, `steps` has solved them without damping.
template <typename Problem>
SolverOutcome minimise(Problem& problem, const SolverOptions& options, SolverWorkspace& room) {
  constexpr double kStill = 1e-11;     // size of a step
  constexpr double kShortest = 1e-12;  // of the root of the cost, or of one deviation
  constexpr double kRounding = 1e-7;   // of the root of the cost, or of one deviation
  constexpr double kNear = 1e-2;
  constexpr double kLeft =
      1e-9;  // distance that the last step leaves, which shrinks as the one before did
  // Of the cost, by which what the state holds beside the parameters may raise it as it settles.
  constexpr double kSettling = 0.1;
  // Of the cost, by which a step may raise it: rounding; and a short step of a problem that holds
  // more than the parameters, whose cost is that of an optimum in the rest only to first order.
  constexpr double kSlack = 1e-10;
  constexpr double kNearSlack = kNear * kNear;
  // After a step that failed: little, since a curved valley that the data hardly show wants little,
  // and soon much more, where the start is far.
  constexpr double kLeastDamping = 1e-8;
  constexpr double kGrowth = 8;
  constexpr double kNoDamping = 1e-12;  // less than this is none
  // A step along a curved valley ends beside it. Others from there, damped more, lead back down and
  // hardly along: most of the rise has to go by each one's own prediction.
  constexpr int kCorrections = 5;
  constexpr double kCorrectionDamping = 100;  // of the step's
  constexpr double kReturn = 0.5;
  SolverOutcome outcome;
  NormalEquations& now = room.now;
  NormalEquations& next = room.next;
  NormalSteps& steps = room.steps;
  Vector& step = room.step;
  step.resize(problem.size());
  if (!options.linearised && !problem.linearise(now)) {
    outcome.failure = "the residuals are not finite at the start";
    return outcome;
  }
  double damping = options.damping;
  double last_distance = std::numeric_limits<double>::infinity();
  double growth = kGrowth;
  bool failed = false;   // the last step
  bool undamped = true;  // no step without damping has failed since there was last none
  bool near = false;
  bool settling = false;  // what the state holds beside the parameters has moved alone
  for (int tried = 0;; ++tried) {
    check_interrupt();
    double decrease = -1;
    bool there = false;  // a step of the parameters would be too short to count
    if (!failed) {
      decrease = tried == 0 && options.linearised ? steps.solve_decomposed(now, step)
                                                  : steps.solve(now, 0, step);
      const double distance = std::sqrt(std::max(decrease, 0.0) / (now.cost + 1));
      there = decrease >= 0 && (distance < kShortest || problem.step_size(step) < kStill ||
                                (distance < kRounding && distance >= last_distance));
      if (there && problem.latents_at_rest()) {
        outcome.converged = true;
        return outcome;
      }
      // Steps of Gauss-Newton that do not become shorter may go round for ever where residuals are
      // large: they must lower the cost then, and are damped until they do.
      near = distance < kNear && distance < last_distance;
      // The last step, where what it leaves is too short to count: the equations stay as they are.
      if (near && undamped && distance < options.last_step &&
          distance * distance < kLeft * last_distance) {
        problem.step(step);
        ++outcome.iterations;
        outcome.converged = true;
        return outcome;
      }
      if constexpr (detail::HasGradient<Problem>::value) {
        // What is left behind this step, if steps shorten quadratically.
        const double shorter = distance / last_distance;
        if (near && undamped && options.keeps_information &&
            distance * shorter * shorter < options.last_step) {
          problem.step(step);
          const double by_gradient =
              problem.linearise_gradient(next) ? steps.solve_again(next.gradient, step) : -1;
          const double left = std::sqrt(by_gradient / (next.cost + 1));
          if (left < options.last_step && left * left < kLeft * distance) {
            options.finishes ? problem.finish(step) : problem.step(step);
            now.cost = next.cost;
            outcome.iterations += 2;
            outcome.converged = true;
            return outcome;
          }
          problem.undo();
          decrease = steps.solve(now, 0, step);
        }
      }
      last_distance = distance;
      if (near && undamped) {
        damping = 0;
      }
    }
    if (tried >= options.max_iterations) {
      outcome.failure = "no convergence in " + std::to_string(tried) + " steps";
      return outcome;
    }
    if (damping > 0 || decrease < 0) {
      if (decrease < 0) {
        damping = std::max(damping, kLeastDamping);
      }
      decrease = steps.solve(now, damping, step);
      if (!(decrease >= 0) || problem.step_size(step) < kStill) {
        outcome.converged = decrease >= 0 && last_distance < kRounding;
        outcome.failure = outcome.converged ? "" : "no step lowers the cost";
        return outcome;
      }
    }
    bool linearised = false;  // wholly, at the state that was stepped to
    const auto take = [&](double slack) {
      problem.step(step);
      linearised = problem.linearise(next);
      return linearised && (next.cost <= now.cost + slack);
    };
    const auto corrected = [&](double slack) {
      if constexpr (detail::HasCorrect<Problem>::value) {
        for (int i = 0; i < kCorrections && linearised; ++i) {
          const double before = next.cost;
          const double predicted = steps.solve(next, kCorrectionDamping * damping, step);
          if (!(predicted > kReturn * (before - now.cost))) {
            return false;
          }
          problem.correct(step);
          if (!problem.linearise(next) || !(next.cost < before)) {
            return false;
          }
          if (next.cost <= now.cost + slack) {
            return true;
          }
        }
      }
      return false;
    };
    failed = !take((there ? kSettling : near ? kNearSlack : kSlack) * (now.cost + 1));
    const bool unsettled = near && !settling && !problem.latents_at_rest();
    settling = failed && unsettled;
    if (failed && !settling) {
      failed = !corrected(kSlack * (now.cost + 1));
    }
    if (settling) {
      // Where the rest of the state is far from its optimum the cost is known to first order only,
      // and may seem lower than any that can be had.
      problem.undo();
      step.setZero();
      failed = !take(kSettling * (now.cost + 1));
    }
    if (failed) {
      problem.undo();
      undamped = undamped && damping > 0;
      damping = std::max(growth * damping, kLeastDamping);
      growth *= kGrowth;
    } else {
      std::swap(now, next);
      ++outcome.iterations;
      growth = kGrowth;
      damping /= 10;
      if (damping < kNoDamping) {
        damping = 0;
        undamped = true;
      }
    }
  }
}

template <typename Problem>
SolverOutcome minimise(Problem& problem, const SolverOptions& options = {}) {
  SolverWorkspace room;
  return minimise(problem, options, room);
}

}  // namespace symkin
