// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Index kPoses = 30;

struct Case {
  Mechanism mechanism;
  Setup setup;
  Observations observations;
  RowMatrix poses;
};

// A drift and a growth of every leg, and a drift of the base, by random covariates.
Case observed(const Mechanism& mechanism, const WorkspaceOptions& workspace, bool points) {
  Random random(3);
  const PoseSpace space = mechanism.pose_space();
  const Index legs = mechanism.leg_count();
  Case made{mechanism, Setup::of(mechanism), {}, {}};
  Setup& setup = made.setup;
  setup.leg_covariates = {{"drift", LegCovariate::Of::reading},
                          {"growth", LegCovariate::Of::lengths}};
  setup.leg_slopes = RowMatrix::Zero(legs, 2);
  setup.base_covariates = {"drift"};
  setup.base_slopes = RowMatrix::Zero(1, 6);
  made.poses = sample_workspace(mechanism, workspace, kPoses, 4).poses;
  Observations& all = made.observations;
  all.readings.values = inverse_kinematics(mechanism, made.poses);
  all.readings.deviations = RowMatrix::Constant(kPoses, legs, 1e-4);
  all.poses = {made.poses, RowMatrix::Constant(kPoses, mechanism.dof(), 1e-4)};
  if (points) {
    setup.points = RowMatrix::Zero(1, 3);
    const Index size = position_size(space);
    all.points = {made.poses.leftCols(size), RowMatrix::Constant(kPoses, size, 1e-4)};
  }
  all.leg_covariates.resize(kPoses, 2 * legs);
  all.base_covariates.resize(kPoses, 1);
  for (double& value : all.leg_covariates.reshaped()) {
    value = random.normal();
  }
  for (double& value : all.base_covariates.reshaped()) {
    value = random.normal();
  }
  return made;
}

Layout everything_free(const Case& of) {
  const std::vector<std::string> names = unknown_names(of.mechanism, of.setup);
  Layout layout;
  Index columns = 0;
  for (const std::string& name : names) {
    const bool curved = name.find(".sensor_") != std::string::npos &&
                        name.find("gain") == std::string::npos &&
                        name.find("offset") == std::string::npos;
    layout.column.push_back(name.empty() || curved ? -1 : columns++);
  }
  layout.prior = Vector::Constant(columns, 1.0);
  return layout;
}

LinearPose linear_at(const Case& of, const Layout& layout, const Setup& setup, Index pose) {
  LatentProblem problem(of.mechanism, of.observations, layout, setup, of.poses,
                        std::vector<bool>(kPoses, false));
  NormalEquations equations;
  EXPECT_TRUE(problem.linearise(equations));
  return problem.linear(pose);
}

std::vector<Case> cases() {
  return {observed(testing::paper_3rrr(), testing::paper_workspace(), false),
          observed(testing::paper_3rrr(), testing::paper_workspace(), true),
          observed(testing::hexapod(), testing::hexapod_workspace(), true)};
}

TEST(Covariates, SlopesHaveTheDerivativesThatDifferencesHave) {
  constexpr double kStep = 1e-5;
  for (const Case& of : cases()) {
    const Layout layout = everything_free(of);
    Vector start = Vector::Zero(layout.columns());
    const UnknownList list(of.setup);
    for (Index scalar = list.leg_slope(0); scalar < list.size(); ++scalar) {
      const Index column = layout.column[static_cast<std::size_t>(scalar)];
      if (column >= 0) {
        // So that no derivative is taken where it is none, and a base may stand elsewhere.
        start[column] = scalar < list.base_slope(0) ? 1e-3 : 0.3;
      }
    }
    const symkin::Setup there = moved(of.setup, layout, start);
    const LinearPose one = linear_at(of, layout, there, 7);
    for (Index i = 0; i < layout.columns(); ++i) {
      Vector step = Vector::Zero(layout.columns());
      step[i] = kStep;
      const Vector up = linear_at(of, layout, moved(there, layout, step), 7).misfit;
      const Vector down = linear_at(of, layout, moved(there, layout, -step), 7).misfit;
      const Vector difference = (up - down) / (2 * kStep);
      EXPECT_LT((difference - one.by_unknowns.col(i)).lpNorm<Eigen::Infinity>(), 1e-6) << i;
    }
  }
}

TEST(Covariates, SlopesAreEstimatedWithAllElse) {
  for (const Case& of : cases()) {
    Layout layout = Layout::of_all_parameters(of.mechanism, of.setup);
    Index columns = layout.columns();
    const UnknownList list(of.setup);
    const std::vector<std::string> names = unknown_names(of.mechanism, of.setup);
    symkin::Setup truth = of.setup;
    for (Index leg = 0; leg < of.mechanism.leg_count(); ++leg) {
      truth.leg_slopes(leg, 0) = 1e-3 * static_cast<double>(leg + 1);
      truth.leg_slopes(leg, 1) = 2e-3;
    }
    for (Index scalar = list.leg_slope(0); scalar < list.size(); ++scalar) {
      if (!names[static_cast<std::size_t>(scalar)].empty()) {
        layout.column[static_cast<std::size_t>(scalar)] = columns++;
      }
    }
    for (const Index slot : frame_slots(of.mechanism.pose_space())) {
      truth.base_slopes(0, slot) = 1e-3;
    }
    layout.prior = Vector::Constant(columns, std::numeric_limits<double>::infinity());
    Observations seen = of.observations;
    for (Index i = 0; i < kPoses; ++i) {
      for (Index leg = 0; leg < of.mechanism.leg_count(); ++leg) {
        const double growth = truth.growths(leg, seen.leg_covariates)[i];
        RowMatrix grown = of.mechanism.parameters();
        const ChainInfo& chain = of.mechanism.model(leg).info();
        for (Index k = 0; k < grown.cols(); ++k) {
          if (grows(chain, chain.parameters[static_cast<std::size_t>(k)])) {
            grown(leg, k) *= 1 + growth;
          }
        }
        const RowMatrix pose = of.poses.middleRows(i, 1);
        seen.readings.values(i, leg) =
            inverse_kinematics(of.mechanism.with_parameters(grown), pose)(0, leg) +
            truth.reading_shifts(leg, seen.leg_covariates)[i];
      }
      const Frame base = truth.base_at(seen.base_covariates.row(i));
      const Frame place = base * frame_of_pose(of.mechanism.pose_space(), &of.poses(i, 0));
      pose_of_frame(of.mechanism.pose_space(), place, seen.poses.values.row(i).data());
      if (seen.points.any()) {
        seen.points.values.row(i) = place.position.head(seen.points.values.cols()).transpose();
      }
    }
    JointOptions options;
    options.start = of.poses;
    const JointFit fit = fit_jointly(of.mechanism, of.setup, seen, layout, options);
    ASSERT_TRUE(fit.converged) << fit.failure;
    EXPECT_LT(fit.goodness.chi_square, 1e-9);
    EXPECT_LT((fit.setup.leg_slopes - truth.leg_slopes).lpNorm<Eigen::Infinity>(), 1e-8);
    EXPECT_LT((fit.setup.base_slopes - truth.base_slopes).lpNorm<Eigen::Infinity>(), 1e-8);
    const RowMatrix changes = fit.setup.parameters - of.setup.parameters;
    EXPECT_LT(changes.lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

TEST(Covariates, OfAnotherShapeOrInfiniteAreRefused) {
  Case of = observed(testing::paper_3rrr(), testing::paper_workspace(), false);
  EXPECT_NO_THROW(of.observations.check(of.mechanism, of.setup));
  Observations none = of.observations;
  none.leg_covariates.resize(0, 0);  // zero
  EXPECT_NO_THROW(none.check(of.mechanism, of.setup));
  Observations few = of.observations;
  few.leg_covariates.conservativeResize(kPoses, 1);
  EXPECT_THROW(few.check(of.mechanism, of.setup), InvalidInput);
  Observations infinite = of.observations;
  infinite.base_covariates(3, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(infinite.check(of.mechanism, of.setup), InvalidInput);
}

}  // namespace
}  // namespace symkin
