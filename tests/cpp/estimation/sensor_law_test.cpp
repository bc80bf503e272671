// SPDX-License-Identifier: MIT

// Sensors that are not straight, as estimates know them: by what their models say alone.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/bent_sensor.hpp"
#include "symkin/chains/rpr.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/starting_point.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

using JointSetup = symkin::Setup;

const LegModelOf<RprActive2, testing::BentSensor> kModel;

// A 3-RPR: base radius and azimuth, platform's, gain, bend and offset of each leg.
Mechanism bent_3rpr(double bend) {
  std::vector<Leg> legs;
  for (int i = 0; i < 3; ++i) {
    const double azimuth = 0.3 + i * 2.0943951023931953;
    legs.push_back({(Vector(7) << 0.8, azimuth, 0.3, azimuth + 1.2, 0.9, bend, 0.1).finished(), 1});
  }
  return {"bent 3-RPR", kModel, legs};
}

RowMatrix poses() {
  RowMatrix poses(40, 3);
  for (Index i = 0; i < 40; ++i) {
    const auto t = static_cast<double>(i);
    poses.row(i) << 0.15 * std::sin(0.7 * t), 0.15 * std::cos(1.1 * t), 0.3 * std::sin(0.3 * t);
  }
  return poses;
}

Observations read_at(const Mechanism& mechanism, bool seen) {
  Observations observations;
  const RowMatrix readings = inverse_kinematics(mechanism, poses());
  observations.readings = {readings, RowMatrix::Constant(40, 3, 1e-5)};
  if (seen) {
    observations.poses = {poses(), RowMatrix::Constant(40, 3, 1e-5)};
  }
  return observations;
}

TEST(SensorOfAnotherLaw, TellsWherePosesStart) {
  const Mechanism mechanism = bent_3rpr(0.05);
  const RowMatrix all = poses();
  const Vector home = all.row(0);
  const RowMatrix found =
      starting_poses(mechanism, JointSetup::of(mechanism), read_at(mechanism, false), home);
  EXPECT_LT((found - all).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SensorOfAnotherLaw, IsIdentifiedWithTheLegs) {
  const Mechanism nominal = bent_3rpr(0.05);
  const Mechanism actual = bent_3rpr(0.06);
  JointOptions options;
  options.start = poses();
  const JointSetup setup = JointSetup::of(nominal);
  const JointFit fit = fit_jointly(nominal, setup, read_at(actual, true),
                                   Layout::of_all_parameters(nominal, setup), options);
  ASSERT_TRUE(fit.converged) << fit.failure;
  EXPECT_LT((fit.setup.parameters - actual.parameters()).cwiseAbs().maxCoeff(), 1e-8);
}

// The readings of one leg at one pose are those of no pose near it, so it waits until the others
// have told where the robot is.
TEST(SensorOfAnotherLaw, TellsTheAspectOfAPoseThatJoinsLater) {
  const Mechanism nominal = bent_3rpr(0.05);
  JointOptions options;
  options.start = poses();
  options.start.row(7).setConstant(std::numeric_limits<double>::quiet_NaN());
  Observations observations = read_at(nominal, true);
  observations.poses.values.row(7).setConstant(std::numeric_limits<double>::quiet_NaN());
  const JointSetup setup = JointSetup::of(nominal);
  const JointFit fit =
      fit_jointly(nominal, setup, observations, Layout::of_all_parameters(nominal, setup), options);
  ASSERT_TRUE(fit.converged) << fit.failure;
  EXPECT_TRUE(fit.aside.empty());
  EXPECT_LT((fit.poses - poses()).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(SensorOfAnotherLaw, HasNoCurvatureBesideItsOwn) {
  const Mechanism mechanism = bent_3rpr(0.05);
  const JointSetup setup = JointSetup::of(mechanism);
  Layout layout = Layout::of_all_parameters(mechanism, setup);
  layout.column[static_cast<std::size_t>(UnknownList(setup).curvature(1))] = 0;
  EXPECT_THROW(layout.check(mechanism, setup), InvalidInput);
}

}  // namespace
}  // namespace symkin
