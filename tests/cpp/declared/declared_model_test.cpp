// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/declared_model.hpp"

#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include <cmath>

#include "declared/declared_numbers.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/kinematics/kinematics.hpp"
#include "symkin/support/error.hpp"

namespace symkin::declared {
namespace {

constexpr double kTurn = 2 * kPi;

Scalar scalar(const char* name, int transform, Slot slot, End end, ParameterKind kind) {
  return {name, transform, slot, {end, kind}, false};
}

// [R]RR of the paper, written joint by joint.
Declaration planar_rrr() {
  const Joint turn;
  Joint read = turn;
  read.read = true;
  const auto T = Step::Kind::transform;
  const auto J = Step::Kind::joint;
  Declaration made{"rrr declared", PoseSpace::planar, {}, Vector::Zero(3), Vector(3), {}, false};
  made.leg.joints = {read, turn, turn};
  made.leg.transforms = {{0.3, 6 / std::sqrt(3)}, {0, 1.5}, {0, 1.6}, {0.4, 1.5 / std::sqrt(3)}};
  made.leg.transforms[0][0] = 210 * kPi / 180;
  made.leg.transforms[3][0] = 211 * kPi / 180;
  made.leg.loops = {{{{T, 0}, {J, 0}, {T, 1}, {J, 1}, {T, 2}, {J, 2}},
                     {{Step::Kind::pose}, {T, 3}},
                     Compares::planar_pose}};
  made.leg.scalars = {
      scalar("base.azimuth", 0, Slot::azimuth, End::base, ParameterKind::axis_azimuth),
      scalar("base.x", 0, Slot::x, End::base, ParameterKind::coordinate),
      scalar("proximal.x", 1, Slot::x, End::none, ParameterKind::coordinate),
      scalar("distal.x", 2, Slot::x, End::none, ParameterKind::coordinate),
      scalar("platform.azimuth", 3, Slot::azimuth, End::platform, ParameterKind::axis_azimuth),
      scalar("platform.x", 3, Slot::x, End::platform, ParameterKind::coordinate)};
  made.home_joints << -150 * kPi / 180, 1, -0.8;
  made.home_joints = joints_at_home(made.leg, pose_of(PoseSpace::planar, made.home_pose.data()),
                                    made.home_joints, {false, false, false});
  return made;
}

Vector parameters_of(const Declaration& declaration) {
  const auto count = static_cast<Index>(declaration.leg.scalars.size());
  Vector values(count + 3);
  for (Index i = 0; i < count; ++i) {
    const Scalar& each = declaration.leg.scalars[static_cast<std::size_t>(i)];
    values[i] = declaration.leg.transforms[static_cast<std::size_t>(each.transform)]
                                          [static_cast<std::size_t>(each.slot)];
  }
  values.tail<3>() << 1, 1.02, 0.1;
  return values;
}

RowMatrix some_poses() {
  RowMatrix poses(4, 3);
  poses << 0, 0, 0, 0.2, -0.1, 0.3, -0.3, 0.2, -0.2, 0.1, 0.3, 0.1;
  return poses;
}

TEST(DeclaredModel, IsTheKnownChainThatItSays) {
  const Declaration declaration = planar_rrr();
  const auto model = declared_model(declaration);
  const Vector parameters = parameters_of(declaration);
  const ChainModel& known = leg_model("[R]RR");
  const Vector& p = parameters;
  Vector own(known.parameter_count());  // which counts the link's angle from the x axis
  own << p[2], p[3], p[1], p[0], p[5], p[4], 1.02, 0.1 + p[0];
  const RowMatrix poses = some_poses();
  Vector readings(4), roots(4), margins(4), known_margins(4);
  model->inverse_kinematics(parameters, 1, poses, readings);
  bool found = false;
  for (const int mode : {-1, 1}) {
    known.inverse_kinematics(own, mode, poses, roots);
    Vector apart(4);
    known.reading_differences(own, roots, readings, apart);
    found = found || apart.cwiseAbs().maxCoeff() < 1e-11;
  }
  EXPECT_TRUE(found);
  ClosureRows rows, known_rows;
  model->linearise(parameters, poses, readings, rows);
  known.linearise(own, poses, readings, known_rows);
  for (Index i = 0; i < 4; ++i) {
    const RowMatrix slope = rows.by_pose.row(i) / rows.by_reading[i];
    const RowMatrix known_slope = known_rows.by_pose.row(i) / known_rows.by_reading[i];
    EXPECT_LT((slope - known_slope).cwiseAbs().maxCoeff(), 1e-11);
  }
  // Stretched a little less than by 0.05 m the estimate is near.
  RowMatrix near(1, 3);
  near << 0, 0, 0;
  for (double x = 0; x < 1; x += 0.002) {
    near(0, 0) = near(0, 1) = x;
    known.reach_margin(own, near, known_margins.head(1));
    if (known_margins[0] < 0.03) {
      break;
    }
  }
  model->reach_margin(parameters, near, margins.head(1));
  EXPECT_NEAR(margins[0], known_margins[0], 0.05 * known_margins[0]);
  near(0, 0) = near(0, 1) = near(0, 0) + 0.5;
  model->reach_margin(parameters, near, margins.head(1));
  known.reach_margin(own, near, known_margins.head(1));
  EXPECT_NEAR(margins[0], known_margins[0], 0.1 * std::abs(known_margins[0]));
}

TEST(DeclaredModel, HasTheRowsThatDifferencesSay) {
  const Declaration declaration = planar_rrr();
  const auto model = declared_model(declaration);
  const Vector parameters = parameters_of(declaration);
  const RowMatrix poses = some_poses();
  Vector readings(4);
  model->inverse_kinematics(parameters, 1, poses, readings);
  ClosureRows rows;
  model->linearise(parameters, poses, readings, rows);
  EXPECT_LT(rows.closure.cwiseAbs().maxCoeff(), 1e-12);
  const double step = 1e-6;
  const auto closures = [&](const Vector& at, const Vector& readings_at) {
    Vector values(4);
    model->closure(at, poses, readings_at, values);
    return values;
  };
  for (Index i = 0; i < parameters.size(); ++i) {
    const bool is_hand = i == parameters.size() - 3;
    Vector up = parameters, down = parameters;
    up[i] += step;
    down[i] -= step;
    const Vector slope = (closures(up, readings) - closures(down, readings)) / (2 * step);
    EXPECT_LT((slope - rows.by_parameters.col(i)).cwiseAbs().maxCoeff(), 1e-8) << i << is_hand;
  }
  const Vector nudge = Vector::Constant(4, step);
  const Vector slope =
      (closures(parameters, readings + nudge) - closures(parameters, readings - nudge)) /
      (2 * step);
  EXPECT_LT((slope - rows.by_reading).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(DeclaredModel, CarriesAPlatformWithItsLike) {
  Declaration declaration = planar_rrr();
  const ChainModel& chain = declare_chain(declaration);
  EXPECT_EQ(&chain, &leg_model("rrr declared"));
  std::vector<Leg> legs;
  for (int i = 0; i < 3; ++i) {
    Vector parameters = parameters_of(declaration);
    parameters[0] += i * kTurn / 3;
    parameters[4] += i * kTurn / 3;
    legs.push_back({parameters, 1});
  }
  const Mechanism mechanism("declared", chain, legs);
  const RowMatrix poses = some_poses();
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  const auto result = forward_kinematics(mechanism, readings, poses.topRows(1));
  EXPECT_EQ(result.converged_count(), 4);
  EXPECT_LT((result.poses - poses).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(DeclaredModel, StandsAtHomeAsItsMirrorImageDoes) {
  const Declaration declaration = planar_rrr();
  const auto model = declared_model(declaration);
  Vector parameters = parameters_of(declaration);
  Vector mirrored = parameters;  // at the x axis
  mirrored[0] *= -1;
  mirrored[4] *= -1;
  mirrored.tail<3>() << -1, 1.02, -0.1;
  const RowMatrix poses = some_poses();
  RowMatrix images = poses;
  images.rightCols(2) *= -1;
  Vector readings(4), of_images(4);
  model->inverse_kinematics(parameters, 1, poses, readings);
  model->inverse_kinematics(mirrored, 1, images, of_images);
  EXPECT_LT((readings + of_images).cwiseAbs().maxCoeff(), 1e-12);
}

// A cable that leaves a pulley at its rim's y, which the arc is times the angle as well.
TEST(DeclaredModel, MirrorsARatioThatIsANumber) {
  const auto t = Step::Kind::transform;
  const auto j = Step::Kind::joint;
  Declaration made{"cable declared", PoseSpace::planar, {}, Vector::Zero(3), Vector(3), {}, false};
  const Joint turn;
  Joint length = turn;
  length.kind = JointKind::slide;
  length.axis = Eigen::Vector3d::UnitX();
  Joint arc = length;
  length.read = true;
  arc.follows = 0;
  arc.ratio = -0.05;
  made.leg.joints = {turn, length, arc, turn};
  made.leg.transforms = {{0.3, 2}, {0, 0, 0.05}, {0.2, 0.3}};
  made.leg.loops = {{{{t, 0}, {j, 0}, {t, 1}, {j, 1}, {j, 2}, {j, 3}},
                     {{Step::Kind::pose}, {t, 2}},
                     Compares::planar_pose}};
  made.leg.scalars = {
      scalar("base.azimuth", 0, Slot::azimuth, End::base, ParameterKind::axis_azimuth),
      scalar("base.x", 0, Slot::x, End::base, ParameterKind::coordinate),
      scalar("rim.y", 1, Slot::y, End::none, ParameterKind::mirrored_coordinate),
      scalar("platform.azimuth", 2, Slot::azimuth, End::platform, ParameterKind::axis_azimuth),
      scalar("platform.x", 2, Slot::x, End::platform, ParameterKind::coordinate)};
  made.leg.scalars[2].uses = {{{j, 2}, Slot::x, -1}};
  made.home_joints << kPi, 1.7, 0;
  made.home_joints = joints_at_home(made.leg, pose_of(PoseSpace::planar, made.home_pose.data()),
                                    made.home_joints, {true, true, false});
  const auto model = declared_model(made);
  Vector parameters(8), mirrored(8);
  parameters << 0.3, 2, 0.06, 0.2, 0.3, 1, 1.02, 0.1;
  mirrored << -0.3, 2, -0.06, -0.2, 0.3, -1, 1.02, 0.1;
  const RowMatrix poses = some_poses();
  RowMatrix images = poses;
  images.rightCols(2) *= -1;
  Vector readings(4), of_images(4), other(4);
  model->inverse_kinematics(parameters, 1, poses, readings);
  model->inverse_kinematics(mirrored, 1, images, of_images);
  EXPECT_LT((readings - of_images).cwiseAbs().maxCoeff(), 1e-12);
  parameters[2] = 0.05;
  model->inverse_kinematics(parameters, 1, poses, other);
  EXPECT_GT((readings - other).cwiseAbs().minCoeff(), 1e-3);
}

TEST(DeclaredModel, HoldsWhatOthersShow) {
  Declaration declaration = planar_rrr();
  declaration.leg.scalars.push_back(
      scalar("proximal.y", 1, Slot::y, End::none, ParameterKind::mirrored_coordinate));
  declaration.leg.scalars.push_back(
      scalar("base.rz", 0, Slot::rz, End::base, ParameterKind::mirrored_small_turn));
  const std::vector<bool> held = redundant_scalars({declaration});
  // Link lengths come first; a turn of the base is the sensor's offset, and y of the link bends it.
  EXPECT_EQ(held, (std::vector<bool>{false, false, false, false, false, false, true, true}));
}

TEST(DeclaredModel, RefusesTwoReadings) {
  Declaration declaration = planar_rrr();
  declaration.leg.joints[1].read = true;
  EXPECT_THROW(declared_model(declaration), InvalidInput);
}

}  // namespace
}  // namespace symkin::declared
