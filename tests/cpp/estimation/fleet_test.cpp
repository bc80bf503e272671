// SPDX-License-Identifier: MIT
#include "symkin/estimation/fleet.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr Index kRobots = 70;

struct Made {
  std::vector<MeasurementSet> robots;
  MeasurementSet all;
  std::vector<Index> first{0};
};

// Robots measured at 36 poses, a third of them for each leg.
Made robots(const Mechanism& nominal) {
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 40, 11).poses;
  Made made;
  made.all.poses.resize(36 * kRobots, 3);
  made.all.readings.resize(36 * kRobots, 3);
  for (Index robot = 0; robot < kRobots; ++robot) {
    const auto seed = static_cast<std::uint64_t>(robot);
    MeasurementSet measured = simulate(disturb(nominal, Tolerances{1e-3, 1e-3, 1e-3}, seed),
                                       nominal, {{-1, poses, 36}}, MeasurementNoise{}, seed)
                                  .measurements;
    for (std::size_t row = 0; row < 36; ++row) {
      measured.leg_sets[row] = static_cast<Index>(row % 3);
    }
    made.all.poses.middleRows(36 * robot, 36) = measured.poses;
    made.all.readings.middleRows(36 * robot, 36) = measured.readings;
    made.all.leg_sets.insert(made.all.leg_sets.end(), measured.leg_sets.begin(),
                             measured.leg_sets.end());
    made.first.push_back(36 * (robot + 1));
    made.robots.push_back(std::move(measured));
  }
  return made;
}

TEST(Fleet, HasARowForEachRobotAsItIsIdentifiedAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  const Made made = robots(nominal);
  for (const Estimator estimator : {Estimator::implicit, Estimator::paper}) {
    for (const PoseUse use : {PoseUse::own, PoseUse::all}) {
      IdentificationOptions options;
      options.estimator = estimator;
      options.use = use;
      const Fleet fleet = identify_many(nominal, made.all, made.first, options, 2);
      const Fleet again = identify_many(nominal, made.all, made.first, options, 1);
      EXPECT_EQ(fleet.parameters, again.parameters);
      for (const Index robot : {Index{0}, Index{33}, kRobots - 1}) {
        const auto i = static_cast<std::size_t>(robot);
        const Identification alone = identify(nominal, made.robots[i], options);
        EXPECT_EQ(fleet.failures[i], "");
        const Eigen::Map<const RowMatrix> parameters(fleet.parameters.row(robot).data(), 3, 8);
        EXPECT_EQ(parameters, alone.parameters);
        EXPECT_EQ(fleet.deviations.row(robot).transpose(),
                  Vector(alone.covariance.diagonal().cwiseSqrt()));
        for (Index leg = 0; leg < 3; ++leg) {
          const GoodnessOfFit& fit = alone.goodness[static_cast<std::size_t>(leg)];
          EXPECT_EQ(fleet.chi_square(robot, leg), fit.chi_square);
          EXPECT_EQ(fleet.degrees_of_freedom(robot, leg),
                    static_cast<double>(fit.degrees_of_freedom));
        }
      }
    }
  }
}

TEST(Fleet, SaysOfARobotThatFailedWhyAndLeavesTheOthersAlone) {
  const Mechanism nominal = testing::paper_3rrr();
  Made made = robots(nominal);
  IdentificationOptions options;
  const Fleet sound = identify_many(nominal, made.all, made.first, options);
  made.all.readings.block(36, 1, 36, 1).setConstant(0.3);                    // robot 1
  made.all.poses(2 * 36 + 5, 0) = std::numeric_limits<double>::quiet_NaN();  // robot 2
  const Fleet fleet = identify_many(nominal, made.all, made.first, options);
  EXPECT_NE(fleet.failures[1].find("leg 2 do not show all"), std::string::npos);
  EXPECT_NE(fleet.failures[2].find("not finite"), std::string::npos);
  EXPECT_TRUE(fleet.parameters.middleRows(1, 2).array().isNaN().all());
  EXPECT_EQ(fleet.parameters.row(0), sound.parameters.row(0));
  EXPECT_EQ(fleet.parameters.bottomRows(kRobots - 3), sound.parameters.bottomRows(kRobots - 3));
}

TEST(Fleet, RefusesRowsThatAreNot) {
  const Mechanism nominal = testing::paper_3rrr();
  const Made made = robots(nominal);
  EXPECT_THROW(identify_many(nominal, made.all, {0, 36, 30}), InvalidInput);
  EXPECT_THROW(identify_many(nominal, made.all, {0, 36 * kRobots + 1}), InvalidInput);
}

}  // namespace
}  // namespace symkin
