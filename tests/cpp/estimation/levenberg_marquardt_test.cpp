// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/levenberg_marquardt.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace symkin {
namespace {

// Residuals of two parameters, and what the solver asks of a problem.
class Curved {
 public:
  explicit Curved(double x, double y) { at_ << x, y; }
  virtual ~Curved() = default;

  Index size() const { return 2; }
  virtual void residuals(RowMatrix& jacobian, Vector& residual) const = 0;
  bool linearise(NormalEquations& equations) {
    RowMatrix jacobian(2, 2);
    Vector residual(2);
    residuals(jacobian, residual);
    equations.information = jacobian.transpose() * jacobian;
    equations.gradient = jacobian.transpose() * residual;
    equations.cost = residual.squaredNorm();
    return std::isfinite(equations.cost);
  }
  void step(const Vector& d) {
    before_ = at_;
    at_ += d;
  }
  void undo() { at_ = before_; }
  bool latents_at_rest() const { return true; }
  double step_size(const Vector& d) const { return d.lpNorm<Eigen::Infinity>(); }
  const Vector& at() const { return at_; }

 protected:
  Vector at_ = Vector(2);
  Vector before_;
};

// Rosenbrock's valley; not finite to the right of 1.5.
class Valley final : public Curved {
 public:
  using Curved::Curved;
  void residuals(RowMatrix& jacobian, Vector& residual) const override {
    residual << 10 * (at_[1] - at_[0] * at_[0]),
        at_[0] > 1.5 ? std::numeric_limits<double>::quiet_NaN() : 1 - at_[0];
    jacobian << -20 * at_[0], 10, -1, 0;
  }
};

// A curved valley along x - y, which is hardly shown beside x + y, and a large rest.
class HardlyShown final : public Curved {
 public:
  using Curved::Curved;
  void residuals(RowMatrix& jacobian, Vector& residual) const override {
    const double along = at_[0] - at_[1];
    residual << 1e4 * (at_.sum() - 5e-4 * along * along), along - 1;
    jacobian << 1e4 * (1 - 1e-3 * along), 1e4 * (1 + 1e-3 * along), 1, -1;
  }
  bool linearise(NormalEquations& equations) {
    const bool finite = Curved::linearise(equations);
    equations.cost += 4e4;
    return finite;
  }
};

// Rosenbrock's valley, steep; a step may be led back into it.
class SteepValley : public Curved {
 public:
  using Curved::Curved;
  void residuals(RowMatrix& jacobian, Vector& residual) const override {
    residual << 1e4 * (at_[1] - at_[0] * at_[0]), 1 - at_[0];
    jacobian << -2e4 * at_[0], 1e4, -1, 0;
  }
};
class SteepValleyWithReturn final : public SteepValley {
 public:
  using SteepValley::SteepValley;
  void correct(const Vector& d) { at_ += d; }
};

// A parabola's root at 0, bent so much, and a straight one at 1; counts what it is asked.
class Bent final : public Curved {
 public:
  Bent(double x, double y, double bend) : Curved(x, y), bend_(bend) {}
  void residuals(RowMatrix& jacobian, Vector& residual) const override {
    residual << at_[0] + bend_ * at_[0] * at_[0], at_[1] - 1 + 0.1 * at_[0];
    jacobian << 1 + 2 * bend_ * at_[0], 0, 0.1, 1;
  }
  bool linearise(NormalEquations& equations) {
    ++whole;
    return Curved::linearise(equations);
  }
  bool linearise_gradient(NormalEquations& equations) {
    ++gradients;
    const bool finite = Curved::linearise(equations);
    equations.information.setConstant(std::numeric_limits<double>::quiet_NaN());
    return finite;
  }

  void finish(const Vector& d) {
    ++finished;
    step(d);
  }

  int whole = 0, gradients = 0, finished = 0;

 private:
  double bend_;
};

// Shows the sum of the parameters alone.
class Sum final : public Curved {
 public:
  using Curved::Curved;
  void residuals(RowMatrix& jacobian, Vector& residual) const override {
    const double sum = at_.sum();
    residual << std::exp(sum) - 1, 0.1 * sum;
    jacobian << std::exp(sum), std::exp(sum), 0.1, 0.1;
  }
};

TEST(LevenbergMarquardt, FindsTheMinimumWithAndWithoutDampingAtFirst) {
  for (const double damping : {0.0, 1e-4, 100.0}) {
    Valley problem(-3, 20);
    const SolverOutcome outcome = minimise(problem, {100, damping});
    EXPECT_TRUE(outcome.converged) << outcome.failure;
    EXPECT_NEAR(problem.at()[0], 1, 1e-11);
    EXPECT_NEAR(problem.at()[1], 1, 1e-11);
  }
}

TEST(LevenbergMarquardt, LinearisesTheGradientAloneWhereThatShowsTheLastStep) {
  SolverOptions options{100, 0, false, 5e-6};
  Bent always(0.02, 0.5, 0.5);
  const SolverOutcome known = minimise(always, options);
  options.keeps_information = true;
  Bent last(0.02, 0.5, 0.5);
  const SolverOutcome outcome = minimise(last, options);
  ASSERT_TRUE(known.converged && outcome.converged) << outcome.failure;
  EXPECT_EQ(always.gradients, 0);
  EXPECT_EQ(last.gradients, 1);
  EXPECT_EQ(last.finished, 0);
  EXPECT_EQ(last.whole + 1, always.whole);
  EXPECT_EQ(outcome.iterations, known.iterations);
  EXPECT_NEAR(last.at()[0], 0, 1e-8);
  EXPECT_NEAR(last.at()[1], 1, 1e-8);
  options.finishes = true;
  Bent alone(0.02, 0.5, 0.5);
  ASSERT_TRUE(minimise(alone, options).converged);
  EXPECT_EQ(alone.finished, 1);
  EXPECT_EQ(alone.at(), last.at());
}

TEST(LevenbergMarquardt, TakesTheDecompositionThatItsRoomHolds) {
  SolverOptions options{100, 0};
  Bent asks(0.02, 0.5, 0.5), knows(0.02, 0.5, 0.5), misled(0.02, 0.5, 0.5);
  ASSERT_TRUE(minimise(asks, options).converged);
  options.linearised = true;
  SolverWorkspace room;
  ASSERT_TRUE(knows.linearise(room.now));
  room.steps.decompose(room.now, 0);
  ASSERT_TRUE(minimise(knows, options, room).converged);
  EXPECT_EQ(knows.whole, asks.whole);
  EXPECT_EQ(knows.at(), asks.at());
  // Those of other equations lead elsewhere at first.
  SolverWorkspace other;
  ASSERT_TRUE(misled.linearise(other.now));
  NormalEquations larger = other.now;
  larger.information *= 1e4;
  other.steps.decompose(larger, 0);
  ASSERT_TRUE(minimise(misled, options, other).converged);
  EXPECT_GT(misled.whole, asks.whole);
}

TEST(LevenbergMarquardt, LinearisesWhollyAgainWhereTheGradientShowsNoLastStep) {
  SolverOptions options{100, 0, false, 5e-6};
  options.keeps_information = true;
  Bent problem(1e-3, 1, 300);
  const SolverOutcome outcome = minimise(problem, options);
  EXPECT_TRUE(outcome.converged) << outcome.failure;
  EXPECT_GE(problem.gradients, 2);
  EXPECT_NEAR(problem.at()[0], 0, 1e-9);
  EXPECT_NEAR(problem.at()[1], 1, 1e-9);
}

TEST(LevenbergMarquardt, FollowsACurvedValleyThatTheDataHardlyShow) {
  HardlyShown problem(0, 0);
  const SolverOutcome outcome = minimise(problem);
  EXPECT_TRUE(outcome.converged) << outcome.failure;
  EXPECT_LE(outcome.iterations, 20);
  EXPECT_NEAR(problem.at()[0] - problem.at()[1], 1, 1e-7);
}

TEST(LevenbergMarquardt, GoesFurtherAlongAValleyWhereStepsMayBeLedBackIntoIt) {
  SteepValley alone(-3, 9);
  SteepValleyWithReturn led(-3, 9);
  const SolverOutcome crawled = minimise(alone, {10000});
  const SolverOutcome outcome = minimise(led);
  ASSERT_TRUE(crawled.converged) << crawled.failure;
  ASSERT_TRUE(outcome.converged) << outcome.failure;
  EXPECT_LT(10 * outcome.iterations, crawled.iterations);
  EXPECT_NEAR(led.at()[0], 1, 1e-9);
}

TEST(LevenbergMarquardt, DoesNotMoveWhatTheDataDoesNotShow) {
  Sum problem(0.9, 0.1);
  const SolverOutcome outcome = minimise(problem);
  EXPECT_TRUE(outcome.converged) << outcome.failure;
  EXPECT_NEAR(problem.at().sum(), 0, 1e-11);
  EXPECT_NEAR(problem.at()[0] - problem.at()[1], 0.8, 1e-11);
}

TEST(LevenbergMarquardt, SaysWhyItDidNotConverge) {
  Valley outside(2, 0);
  EXPECT_EQ(minimise(outside).failure, "the residuals are not finite at the start");
  Valley far(-3, 20);
  const SolverOutcome outcome = minimise(far, {2, 0.0});
  EXPECT_FALSE(outcome.converged);
  EXPECT_EQ(outcome.failure, "no convergence in 2 steps");
}

}  // namespace
}  // namespace symkin
