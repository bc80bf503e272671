// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/robust_fit.hpp"

#include <ceres/loss_function.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>

#include "estimation/welsch_loss.hpp"
#include "robust_numbers.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

Vector vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Index>(values.size()));
}

// y = X z + noise, in blocks; as minimise() and as fit_robustly() take a problem.
class LinearProblem {
 public:
  explicit LinearProblem(const testing::RobustCase& from) {
    const auto rows = static_cast<Index>(from.y.size());
    blocks_.jacobian =
        -Eigen::Map<const RowMatrix>(from.x.data(), rows, static_cast<Index>(from.parameters));
    y_ = vector_of(from.y);
    for (Index end = from.conditions; end <= rows; end += from.conditions) {
      blocks_.first.push_back(end);
    }
    change_.setZero(from.parameters);
  }

  Index size() const { return change_.size(); }
  bool linearise(NormalEquations& equations) {
    equations.reset(size());
    const Vector residual = y_ + blocks_.jacobian * change_;
    for (Index i = 0; i < blocks_.count(); ++i) {
      const Index k = blocks_.conditions(i);
      const auto rows = blocks_.jacobian.middleRows(i * k, k);
      const auto own = residual.segment(i * k, k);
      const BlockLoss::Value value = losses_->of(k).at(own.squaredNorm());
      equations.cost += value.cost;
      equations.information += value.weight * rows.transpose() * rows;
      equations.gradient += value.weight * rows.transpose() * own;
    }
    return true;
  }
  void step(const Vector& d) { change_ += last_ = d; }
  void undo() { change_ -= last_; }
  bool latents_at_rest() const { return true; }
  double step_size(const Vector& d) const { return d.lpNorm<Eigen::Infinity>(); }

  void solve(BlockLosses& losses) {
    losses_ = &losses;
    SolverWorkspace room;
    outcome_ = minimise(*this, {500, 0}, room);
    cost_ = room.now.cost;
    information_ = room.now.information;
  }
  bool converged() const { return outcome_.converged; }
  double cost() const { return cost_; }
  WhitenedSystem system() const {
    WhitenedSystem blocks = blocks_;
    blocks.residual = y_ + blocks_.jacobian * change_;
    return blocks;
  }
  void move(const Vector& change) { change_ += change; }
  static std::vector<Index> guard(const WhitenedSystem& /*blocks*/) { return {}; }

  const Vector& estimate() const { return change_; }
  const RowMatrix& information() const { return information_; }

 private:
  WhitenedSystem blocks_;
  Vector y_, change_, last_;
  BlockLosses* losses_ = nullptr;
  SolverOutcome outcome_;
  double cost_ = 0;
  RowMatrix information_;
};

TEST(RobustLoss, BendsWhereItKeeps95PercentOfTheEfficiency) {
  for (const testing::TuningCase& expected : testing::kTuning) {
    EXPECT_NEAR(s_scale_bend(expected.conditions) / expected.s_scale, 1, 1e-8);
    const double bends[] = {expected.huber, expected.cauchy, expected.tukey};
    const std::vector<std::string> names = loss_names();
    ASSERT_EQ(names.size(), 4U);
    for (std::size_t i = 0; i < 3; ++i) {
      const RobustLoss loss = loss_named(names[i + 1]);
      EXPECT_NEAR(bend_of(*loss.family, expected.conditions) / bends[i], 1, 1e-8) << names[i + 1];
      const BlockLoss::Kept kept = BlockLoss(loss, expected.conditions, 1).kept();
      const double found[] = {kept.limit, kept.share, kept.mean, kept.variance};
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(found[k] / expected.kept[i][k], 1, 1e-8) << names[i + 1] << ", " << k;
      }
    }
  }
}

TEST(RobustLoss, ParametersTakeLessFromKeptBlocksThanFromAll) {
  // By SciPy's quadrature.
  const struct {
    const char* name;
    Index conditions;
    double taken;
  } cases[] = {{"cauchy", 1, 0.945}, {"cauchy", 3, 0.884}, {"cauchy", 6, 0.765},
               {"tukey", 1, 0.984},  {"tukey", 3, 0.959},  {"tukey", 6, 0.922}};
  for (const auto& each : cases) {
    const BlockLoss loss(loss_named(each.name), each.conditions, 1);
    EXPECT_NEAR(loss.kept().taken, each.taken, 6e-4) << each.name << ", " << each.conditions;
  }
}

TEST(RobustLoss, WithoutOneBlocksKeepTheirWeightAndAllOfTheirSquares) {
  const BlockLoss none(RobustLoss{}, 3, 1);
  EXPECT_EQ(none.at(1e6).weight, 1);
  EXPECT_EQ(none.kept().mean, 3);
  EXPECT_EQ(none.kept().variance, 6);
  EXPECT_EQ(none.kept().taken, 1);
}

TEST(RobustLoss, OfAUsersOwnBendsByTheSameRule) {
  const LossFamily welsch = testing::welsch();
  // Published: 2.9846 for exp(-(d / c)^2 / 2), whose width is a root of two times ours.
  EXPECT_NEAR(bend_of(welsch, 1), 2.9846, 1e-3);
}

TEST(RobustLoss, KeepsLargeBlocksAsOftenAsThoseOfAFullPose) {
  for (const char* name : {"huber", "cauchy", "tukey"}) {
    const RobustLoss loss = loss_named(name);
    const double share = BlockLoss(loss, 6, 1).kept().share;
    double before = bend_of(*loss.family, 6);
    for (const Index conditions : {7, 9, 10, 15, 30, 60}) {
      const BlockLoss::Kept kept = BlockLoss(loss, conditions, 1).kept();
      EXPECT_NEAR(kept.share, share, 1e-9) << name << ", " << conditions;
      EXPECT_GT(bend_of(*loss.family, conditions), before) << name << ", " << conditions;
      before = bend_of(*loss.family, conditions);
    }
  }
}

// Of s the share `begin` of least squares.
class ScaledLoss final : public ceres::LossFunction {
 public:
  explicit ScaledLoss(double begin) : begin_(begin) {}
  void Evaluate(double s, double* rho) const override {
    rho[0] = begin_ * s;
    rho[1] = begin_;
    rho[2] = 0;
  }

 private:
  double begin_;
};

TEST(RobustLoss, RefusesAFunctionThatIsNoLoss) {
  using Start = LossFamily::Start;
  using Made = std::unique_ptr<ceres::LossFunction>;
  const LossFamily families[] = {
      {"none", Start::two, nullptr},
      {"null", Start::two, [](double) { return Made(); }},
      {"zero", Start::two, [](double) -> Made { return std::make_unique<ScaledLoss>(0); }},
      {"double", Start::two, [](double) -> Made { return std::make_unique<ScaledLoss>(2); }},
      {"nan", Start::two,
       [](double) -> Made { return std::make_unique<ScaledLoss>(std::nan("")); }},
  };
  for (const LossFamily& family : families) {
    EXPECT_THROW((RobustLoss{&family}.check()), InvalidInput) << family.name;
  }
  EXPECT_NO_THROW((RobustLoss{loss_named("tukey")}.check()));
}

TEST(RobustLoss, RefusesANameThatThereIsNot) {
  try {
    loss_named("hubre");
    FAIL() << "expected a refusal";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("\"huber\", \"cauchy\", \"tukey\""),
              std::string::npos);
  }
}

TEST(RobustFit, EndsWhereAnotherProgramDoesAndSaysTheSameOfIt) {
  for (const testing::RobustCase& expected : testing::kRobust) {
    for (const testing::RobustFit& fit : expected.fits) {
      LinearProblem problem(expected);
      EXPECT_NEAR(leverages(problem.system()).maxCoeff(), expected.largest_leverage, 1e-9);
      auto [losses, open] = fit_robustly(problem, loss_named(fit.loss));
      ASSERT_TRUE(problem.converged());
      const Vector deviations = vector_of(fit.deviations);
      EXPECT_LT((problem.estimate() - vector_of(fit.estimate))
                    .cwiseQuotient(deviations)
                    .lpNorm<Eigen::Infinity>(),
                1e-7)
          << fit.loss << ", " << expected.conditions;
      EXPECT_NEAR(problem.cost() / 2 / fit.objective, 1, 1e-9);

      const WhitenedSystem blocks = problem.system();
      const Vector squares = blocks.squares(Vector::Zero(problem.size()));
      for (Index i = 0; i < squares.size(); ++i) {
        EXPECT_NEAR(losses.of(expected.conditions).at(squares[i]).weight,
                    fit.weights[static_cast<std::size_t>(i)], 1e-8);
      }
      const RobustStatistics found = robust_statistics(
          squares,
          std::vector<Index>(static_cast<std::size_t>(blocks.count()), expected.conditions),
          problem.size(), losses);
      EXPECT_EQ(found.kept, fit.kept);
      EXPECT_EQ(found.student_degrees, fit.student_degrees);
      EXPECT_NEAR(found.sum_of_squares / fit.sum_of_squares, 1, 1e-7);
      EXPECT_NEAR(found.chi_square / fit.chi_square, 1, 1e-7);
      // The other program counts as if the parameters took from the kept as from all.
      const auto size = static_cast<double>(problem.size());
      const double of_kept = size / static_cast<double>(expected.conditions * found.kept);
      const double of_all = size / static_cast<double>(blocks.rows());
      const double taken = losses.of(expected.conditions).kept().taken;
      EXPECT_NEAR(found.degrees_of_freedom / fit.degrees_of_freedom,
                  (1 - taken * of_all) / (1 - of_kept), 1e-8);
      const Vector own = (found.variance * inverse(problem.information()).diagonal()).cwiseSqrt();
      EXPECT_LT((own.cwiseQuotient(deviations).array() - 1).abs().maxCoeff(), 1e-7)
          << fit.loss << ", " << expected.conditions;
    }
  }
}

// Six conditions of twenty blocks, a sixth of which the parameters take: Cauchy's loss rejects a
// fifth of sound blocks, and a fit has drawn the others in.
TEST(RobustFit, ChiSquareOfSoundBlocksIsOneADegreeWhereTheyAreFew) {
  constexpr int kFits = 400;
  testing::RobustCase sound{};
  sound.conditions = 6;
  sound.parameters = 20;
  sound.y.resize(120);
  sound.x.resize(120 * 20);
  Random random(11);
  const std::vector<Index> conditions(20, 6);
  for (const char* const name : {"huber", "cauchy", "tukey"}) {
    double sum = 0;
    for (int fit = 0; fit < kFits; ++fit) {
      for (std::vector<double>* const values : {&sound.x, &sound.y}) {
        std::generate(values->begin(), values->end(), [&] { return random.normal(); });
      }
      LinearProblem problem(sound);
      BlockLosses losses(loss_named(name));
      problem.solve(losses);
      const RobustStatistics found = robust_statistics(
          problem.system().squares(Vector::Zero(problem.size())), conditions, 20, losses);
      sum += found.chi_square / found.degrees_of_freedom;
    }
    EXPECT_GT(sum / kFits, 0.98) << name;
    EXPECT_LT(sum / kFits, 1.03) << name;
  }
}

TEST(RobustFit, CountsPriorsAsConditionsThatNoLossRejects) {
  // The loss bends beyond all residuals.
  BlockLosses losses(loss_named("huber", 1e3));
  const RobustStatistics found =
      robust_statistics(Vector::Constant(10, 3), std::vector<Index>(10, 3), 8, losses, 6, 5);
  EXPECT_NEAR(found.degrees_of_freedom, 10 * 3 + 6 - 8, 1e-6);
  EXPECT_NEAR(found.chi_square, 10 * 3 + 5, 1e-6);
}

TEST(RobustFit, SubsetsLeadToTheEstimateOfLeastSScale) {
  for (const testing::RobustCase& expected : testing::kRobust) {
    const SubsetStart found = best_of_subsets(LinearProblem(expected).system());
    EXPECT_NEAR(found.scale, expected.s_scale, 1e-3 * expected.s_scale);
    EXPECT_LT((found.change - vector_of(expected.s_estimate)).lpNorm<Eigen::Infinity>(), 1e-2);
  }
}

TEST(RobustFit, ScaledResidualsGiveTheSameFitAtTheirOwnScale) {
  testing::RobustCase plain = testing::kRobust[0];
  LinearProblem problem(plain);
  RobustLoss loss = loss_named("tukey");
  auto [losses, open] = fit_robustly(problem, loss);
  for (double& y : plain.y) {
    y *= 7;
  }
  LinearProblem larger(plain);
  loss.spread = 7;
  auto [of_larger, open_too] = fit_robustly(larger, loss);
  EXPECT_LT((larger.estimate() / 7 - problem.estimate()).lpNorm<Eigen::Infinity>(), 1e-8);
  const std::vector<Index> conditions(static_cast<std::size_t>(problem.system().count()), 1);
  const Vector none = Vector::Zero(problem.size());
  const RobustStatistics a =
      robust_statistics(problem.system().squares(none), conditions, 4, losses);
  const RobustStatistics b =
      robust_statistics(larger.system().squares(none), conditions, 4, of_larger);
  EXPECT_NEAR(b.variance / a.variance, 49, 1e-6);
  EXPECT_NEAR(b.chi_square / a.chi_square, 1, 1e-6);
}

// n rows, the first of which alone shows half of the second parameter.
WhitenedSystem with_leverage(Index count, double alone) {
  WhitenedSystem blocks;
  blocks.jacobian = RowMatrix::Zero(count, 2);
  blocks.jacobian.col(0).setOnes();
  blocks.residual.setZero(count);
  for (Index i = 0; i < count; ++i) {
    blocks.jacobian(i, 1) = i == 0 ? alone : (i % 2 == 0 ? 1 : -1);
    blocks.first.push_back(i + 1);
  }
  return blocks;
}

TEST(RobustFit, PromisesNothingWhereOnePoseDecidesAndSaysHowManyMoreItTakes) {
  std::vector<Index> names;
  for (Index i = 0; i < 40; ++i) {
    names.push_back(i + 10);
  }
  const RobustLoss cauchy = loss_named("cauchy");
  const RobustLoss tukey = loss_named("tukey");
  EXPECT_TRUE(unguarded(with_leverage(40, 3), tukey, "leg 2", names).empty());
  const WhitenedSystem doubtful = with_leverage(40, 8);
  const double leverage = leverages(doubtful).maxCoeff();
  ASSERT_GT(leverage, kGuarded);
  ASSERT_LT(leverage, kMostLeverage);
  EXPECT_EQ(unguarded(doubtful, cauchy, "leg 2", names), std::vector<Index>{10});
  EXPECT_THROW(unguarded(doubtful, tukey, "leg 2", names), InvalidInput);
  try {
    unguarded(with_leverage(4, 8), cauchy, "leg 2", names);
    FAIL() << "expected a refusal";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("pose 11, which leg 2 follows"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("measure 2 poses more"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace symkin
