// SPDX-License-Identifier: MIT

// Where fits of the general estimator end, whatever the unit and wherever they start.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "support/mechanisms.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/estimation/starting_point.hpp"

namespace symkin {
namespace {

using JointSetup = symkin::Setup;

constexpr double kNone = std::numeric_limits<double>::infinity();

Observations observed(const Mechanism& nominal, const MeasurementSet& measured,
                      const MeasurementNoise& noise) {
  const Index count = measured.poses.rows();
  const Vector deviations = noise.pose_variances(nominal.pose_space()).cwiseSqrt();
  Observations observations;
  observations.readings = {measured.readings,
                           RowMatrix::Constant(count, nominal.leg_count(), noise.reading)};
  observations.poses = {measured.poses, deviations.transpose().replicate(count, 1)};
  return observations;
}

// All parameters of the legs with their tolerances, if they are wanted, and frames.
struct Unknowns {
  Layout layout;
  Vector tolerances;

  Unknowns(const Mechanism& nominal, const Tolerances& tolerance, bool legs, bool target) {
    const JointSetup setup = JointSetup::of(nominal);
    const UnknownList list(setup);
    layout.column.assign(static_cast<std::size_t>(list.size()), -1);
    std::vector<double> priors;
    for (Index leg = 0; legs && leg < nominal.leg_count(); ++leg) {
      const Vector deviations = tolerance.deviations(nominal, leg);
      for (const Index i : nominal.estimated_parameters(leg)) {
        free(list.leg(leg) + i, deviations[i], priors);
      }
    }
    for (const Index frame : {list.base(), list.target()}) {
      for (const Index slot : frame_slots(nominal.pose_space())) {
        if (frame == list.base() || target) {
          free(frame + slot, kNone, priors);
        }
      }
    }
    layout.prior = Eigen::Map<const Vector>(priors.data(), static_cast<Index>(priors.size()));
    tolerances = (layout.prior.array() < kNone).select(layout.prior, 0);
  }

 private:
  void free(Index scalar, double prior, std::vector<double>& priors) {
    layout.column[static_cast<std::size_t>(scalar)] = static_cast<Index>(priors.size());
    priors.push_back(prior);
  }
};

JointFit fit(const Mechanism& nominal, const Observations& observations, const Unknowns& unknowns,
             const RowMatrix& poses, bool target) {
  const Vector home = poses.row(0);
  const JointSetup setup =
      with_starting_frames(nominal, JointSetup::of(nominal), observations, home, true, target);
  JointOptions options;
  options.tolerances = unknowns.tolerances;
  options.gauge = Gauge::nominal;
  options.rows = false;
  options.start = starting_poses(nominal, setup, observations, home);
  return fit_jointly(nominal, setup, observations, unknowns.layout, options);
}

struct Robot {
  std::string name;
  Mechanism nominal;
  RowMatrix poses;
  bool angular;  // the readings
};

std::vector<Robot> robots() {
  WorkspaceOptions plane;
  plane.lower = Eigen::Vector2d(-0.15, 0.3);
  plane.upper = Eigen::Vector2d(0.15, 0.5);
  plane.home = Eigen::Vector2d(0, 0.4);
  std::vector<Robot> robots{{"3-RRR", testing::paper_3rrr(), {}, true},
                            {"five-bar", testing::five_bar(), {}, true},
                            {"hexapod", testing::hexapod(), {}, false}};
  const WorkspaceOptions workspaces[] = {testing::paper_workspace(), plane,
                                         testing::hexapod_workspace()};
  for (std::size_t i = 0; i < robots.size(); ++i) {
    robots[i].poses = sample_workspace(robots[i].nominal, workspaces[i], 24, 3).poses;
  }
  return robots;
}

// The frame that starts the fit is its solution then.
TEST(JointFit, OfARobotAsDrawnInAFreeFrameConverges) {
  const MeasurementNoise noise{1e-4, 1e-4, 0};
  for (const Robot& robot : robots()) {
    const Unknowns unknowns(robot.nominal, {}, false, false);
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
      const MeasurementSet measured =
          simulate(robot.nominal, robot.nominal, {{-1, robot.poses, 24}}, noise, seed).measurements;
      const JointFit found = fit(robot.nominal, observed(robot.nominal, measured, noise), unknowns,
                                 robot.poses, false);
      EXPECT_TRUE(found.converged) << robot.name << ", seed " << seed << ": " << found.failure;
      EXPECT_LE(found.iterations, 6) << robot.name << ", seed " << seed;
    }
  }
}

Mechanism scaled(const Mechanism& mechanism, double unit) {
  RowMatrix parameters = mechanism.parameters();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
      const ParameterInfo& parameter = chain.parameters[i];
      if (!chain.is_angular(parameter) && parameter.role.kind != ParameterKind::gain) {
        parameters(leg, static_cast<Index>(i)) *= unit;
      }
    }
  }
  return mechanism.with_parameters(parameters);
}

TEST(JointFit, TakesTheSameStepsInAnyUnitOfLength) {
  for (Robot& robot : robots()) {
    const Index position = position_size(robot.nominal.pose_space());
    const RowMatrix poses = robot.poses;
    int iterations = 0;
    double chi_square = 0;
    for (const double unit : {1.0, 1e-3, 1e3, 1e6}) {
      const Mechanism nominal = scaled(robot.nominal, unit);
      const MeasurementNoise noise{1e-4 * unit, 1e-4, 5e-5 * (robot.angular ? 1 : unit)};
      const Tolerances tolerance{1e-3 * unit, 1e-3, 1e-3};
      robot.poses = poses;
      robot.poses.leftCols(position) *= unit;
      const Mechanism actual = disturb(nominal, tolerance, 7);
      const MeasurementSet measured =
          simulate(actual, nominal, {{-1, robot.poses, 24}}, noise, 5).measurements;
      const JointFit found = fit(nominal, observed(nominal, measured, noise),
                                 Unknowns(nominal, tolerance, true, false), robot.poses, false);
      ASSERT_TRUE(found.converged) << robot.name << " x " << unit << ": " << found.failure;
      iterations = iterations == 0 ? found.iterations : iterations;
      chi_square = chi_square == 0 ? found.chi_square_data : chi_square;
      EXPECT_EQ(found.iterations, iterations) << robot.name << " x " << unit;
      EXPECT_NEAR(found.chi_square_data / chi_square, 1, 1e-8) << robot.name << " x " << unit;
    }
  }
}

// Level poses tell nothing of the target's place on the platform, but for their noise. Where that
// put it, metres away, hundreds of steps did not lead back.
TEST(JointFit, OfLevelPosesBeginsWithTheTargetNearWhereItIsDrawn) {
  const Mechanism nominal = testing::hexapod();
  const MeasurementNoise noise{1e-4, 1e-4, 5e-5};
  RowMatrix poses(36, 7);
  for (Index k = 0; k < 36; ++k) {
    poses.row(k) << 0.08 * static_cast<double>(k % 3 - 1),
        0.08 * static_cast<double>(k / 3 % 3 - 1), 0.64 + 0.04 * static_cast<double>(k / 9), 0, 0,
        0, 1;
  }
  const Unknowns unknowns(nominal, {}, true, true);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Mechanism actual = disturb(nominal, {}, seed);
    const MeasurementSet measured =
        simulate(actual, nominal, {{-1, poses, 36}}, noise, seed).measurements;
    const JointFit found = fit(nominal, observed(nominal, measured, noise), unknowns, poses, true);
    EXPECT_TRUE(found.converged) << "seed " << seed << ": " << found.failure;
    EXPECT_LE(found.iterations, 50) << "seed " << seed;
    EXPECT_EQ(found.data_rank, 48);
  }
}

// Each end of a leg may move with the other as far as the poses are level. Along that valley the
// ends' angles bend it, and steps that only follow its slope took hundreds.
TEST(JointFit, OfLevelPosesWithoutPriorsFollowsTheCurvedValley) {
  const Mechanism nominal = testing::hexapod();
  const MeasurementNoise noise{2e-5, 2e-5, 5e-6};
  const Tolerances tolerance{5e-3, 1e-2, 1e-2};
  RowMatrix poses(108, 7);
  for (Index k = 0; k < 108; ++k) {
    poses.row(k) << 0.06 * static_cast<double>(k % 6) - 0.15,
        0.06 * static_cast<double>(k / 6 % 6) - 0.15, 0.64 + 0.06 * static_cast<double>(k / 36), 0,
        0, 0, 1;
  }
  Unknowns unknowns(nominal, tolerance, true, true);
  unknowns.layout.prior.setConstant(kNone);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Mechanism actual = disturb(nominal, tolerance, seed);
    const MeasurementSet measured =
        simulate(actual, nominal, {{-1, poses, 108}}, noise, seed).measurements;
    const JointFit found = fit(nominal, observed(nominal, measured, noise), unknowns, poses, true);
    EXPECT_TRUE(found.converged) << "seed " << seed << ": " << found.failure;
    EXPECT_LE(found.iterations, 80) << "seed " << seed;
    EXPECT_LT(found.goodness.chi_square, 1.2 * found.goodness.degrees_of_freedom);
  }
}

}  // namespace
}  // namespace symkin
