// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "chains/every_chain.hpp"
#include "symkin/model/estimated_parameters.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin::testing {
namespace {

// Chains of legs in space, on whatever platform.
class Spatial : public EveryChain {
 protected:
  static constexpr double kStep = 1e-5;

  bool is_pulley() const { return GetParam().name == "U[P]S pulley"; }
  bool has_two() const { return info().active_joint != ActiveJoint::distance; }

  // Whatever the working mode means.
  std::vector<State> spatial_states(int count, std::uint64_t seed = 1) const {
    Random random(seed);
    std::vector<State> states;
    while (static_cast<int>(states.size()) < count) {
      State state{random_parameters(random), random_pose(random, 1.5),
                  random.uniform() < 0.5 ? -1 : 1, 0};
      if (has_quaternion(info().pose_space)) {
        state.pose.rightCols<4>().normalize();
      }
      state.reading = reading(state, state.mode);
      if (margin(state) > 0.05 && std::abs(linearise(state).by_reading[0] / gain(state)) > 0.1) {
        states.push_back(state);
      }
    }
    return states;
  }

  bool moves() const { return position_size(info().pose_space) > 0; }

  // The pose translated by `way`, or turned where the platform only turns.
  State displaced(State state, const Eigen::Vector3d& way) const {
    Vector step = Vector::Zero(degrees_of_freedom(info().pose_space));
    step.head<3>() = way;
    move_pose(info().pose_space, step.data(), state.pose.data());
    return state;
  }

  double between_readings(const State& state, double a, double b) const {
    const double gap = gain(state) * (a - b);
    return std::abs(is_angle(info().active_joint) ? wrap_angle(gap) : gap);
  }

  // A frame whose base is off the origin; so is the platform, and turned, if it turns. On a sphere
  // both are where its centre is.
  SymmetryGroup group() const {
    SymmetryFrame frame = SymmetryFrame::about_origin(0.7);
    if (!moves()) {
      frame.platform_axis = -0.9;
      return {5, true, frame};
    }
    frame.base_centre = {0.3, -0.2};
    if (has_orientation(info().pose_space)) {
      frame.platform_centre = {-0.05, 0.1};
      frame.platform_axis = -0.9;
    }
    return {5, true, frame};
  }

  // From the base point, upwards, along the circle to where the cable leaves it as a tangent.
  void expect_cable_drawn(const State& state, const RowMatrix& joints) const {
    const double radius = parameter(state, "pulley_radius");
    const Eigen::Vector3d base = joints.row(0), leaving = joints.row(1), end = joints.row(2);
    Eigen::Vector3d outward = end - base;
    outward.z() = 0;
    outward.normalize();
    const Eigen::Vector3d centre = base + radius * outward, arm = leaving - centre;
    EXPECT_NEAR(arm.norm(), radius, 1e-12);
    EXPECT_NEAR(arm.dot(end - leaving), 0, 1e-11);
    double wrapped = std::atan2(arm.z(), -arm.dot(outward));
    wrapped += wrapped < 0 ? 2 * kPi : 0;
    EXPECT_NEAR(radius * wrapped + (end - leaving).norm(), active_joint(state), 1e-11);
  }

  State image(SymmetryElement element, const State& state) const {
    const Leg leg = transform_leg(group(), element, info(), {state.parameters, state.mode});
    return {leg.parameters, transform_poses(group(), element, info().pose_space, state.pose),
            leg.working_mode, reading_sign(element, info().active_joint) * state.reading};
  }
};

TEST_P(Spatial, RootsCloseTheLegInEachWorkingModeWithTheSlopeOfIts) {
  for (State state : spatial_states(kStates)) {
    for (const int mode : {-1, 1}) {
      state.reading = reading(state, mode);
      EXPECT_NEAR(closure(state), 0, 1e-12);
      const double slope = linearise(state).by_reading[0] / gain(state);
      if (GetParam().name == "[P]US" || GetParam().name == "[P]RS") {
        EXPECT_LT(mode * slope, 0);  // e . (rod) = -L dh/dq
      } else if (GetParam().name == "[R]US") {
        EXPECT_LT(mode * slope, 0);  // a . (crank x rod) = -L dh/dq
      } else if (GetParam().name == "[R]RR") {
        EXPECT_LT(mode * slope, 0);  // w . (m x v) = -sin(arc) dh/dq
      }
    }
  }
}

TEST_P(Spatial, ReachEndsWhereTheReadingIsMissingAndOneMarginAway) {
  Random random(2);
  int outside = 0;
  for (int i = 0; i < kStates; ++i) {
    State state{random_parameters(random), random_pose(random, 3), 1, 0};
    if (has_quaternion(info().pose_space)) {
      state.pose.rightCols<4>().normalize();
    }
    const double here = margin(state);
    ASSERT_EQ(std::isnan(reading(state, 1)), here < 0);
    outside += here < 0 ? 1 : 0;
    if (!std::isfinite(here)) {
      continue;
    }
    // Where the margin changes fastest, just so far: beyond lies a region that may be tiny.
    Eigen::Vector3d steepest;
    for (Index k = 0; k < 3; ++k) {
      steepest[k] = margin(displaced(state, 1e-6 * Eigen::Vector3d::Unit(k))) - here;
    }
    steepest.normalize();
    bool crossed = false;
    for (int k = 0; k < 400; ++k) {
      Eigen::Vector3d way(2 * random.uniform() - 1, 2 * random.uniform() - 1,
                          2 * random.uniform() - 1);
      way.normalize();
      if (k == 0) {
        way = here > 0 ? -steepest : steepest;
      }
      State moved = displaced(state, 0.999 * std::abs(here) * way);
      EXPECT_EQ(margin(moved) > 0, here > 0);
      moved = displaced(moved, (k == 0 ? 0.002 : 0.11) * std::abs(here) * way);
      crossed = crossed || (margin(moved) > 0) != (here > 0);
    }
    EXPECT_TRUE(crossed) << "margin " << here;
  }
  EXPECT_EQ(outside > 0, has_two() || is_pulley());
}

TEST_P(Spatial, DerivativesMatchCentralDifferences) {
  for (State state : spatial_states(50)) {
    state.reading += 0.1;
    const ClosureRows rows = linearise(state);
    const auto difference = [&](double& value) {
      const double middle = value;
      value = middle + kStep;
      const Vector above = closures(state);
      value = middle - kStep;
      const Vector below = closures(state);
      value = middle;
      return Vector((above - below) / (2 * kStep));
    };
    for (Index i = 0; i < state.parameters.size(); ++i) {
      const Vector error = rows.by_parameters.col(i) - difference(state.parameters[i]);
      EXPECT_LT(error.lpNorm<Eigen::Infinity>(), 1e-7)
          << info().parameters[static_cast<std::size_t>(i)].name;
    }
    EXPECT_LT((rows.by_reading - difference(state.reading)).lpNorm<Eigen::Infinity>(), 1e-7);
    Vector step = Vector::Zero(degrees_of_freedom(info().pose_space));
    const RowMatrix pose = state.pose;
    for (Index i = 0; i < step.size(); ++i) {
      const auto at = [&](double size) {
        step[i] = size;
        state.pose = pose;
        move_pose(info().pose_space, step.data(), state.pose.data());
        return closures(state);
      };
      const Vector error = rows.by_pose.col(i) - (at(kStep) - at(-kStep)) / (2 * kStep);
      EXPECT_LT(error.lpNorm<Eigen::Infinity>(), 1e-7);
      step[i] = 0;
      state.pose = pose;
    }
  }
}

TEST_P(Spatial, ImagesUnderRotationsAndReflectionsCloseAndReadAlike) {
  for (State state : spatial_states(50)) {
    for (const SymmetryElement element : group().elements()) {
      const State moved = image(element, state);
      EXPECT_LT(between_readings(moved, reading(moved, moved.mode), moved.reading), 1e-10);
      EXPECT_TRUE(std::isinf(margin(state)) || std::abs(margin(moved) - margin(state)) < 1e-12);
      State open = state;
      open.reading += 0.2;
      // A reflection changes the side of a plane that an axis stands on.
      const Vector moved_closures = closures(image(element, open));
      EXPECT_NEAR(moved_closures[0], closure(open), 1e-12);
      if (info().closures > 1) {
        EXPECT_NEAR(moved_closures[1], (element.reflection ? -1 : 1) * closures(open)[1], 1e-12);
      }
    }
  }
}

// No more and no fewer than what poses can show.
TEST_P(Spatial, EstimatedParametersHaveFullRankAndTheOthersAddNone) {
  Random random(6);
  for (int leg = 0; leg < 5; ++leg) {
    Vector parameters = random_parameters(random);
    if (GetParam().name == "R[P]S") {  // not upright, or a height is held that poses do show
      parameters[*find_parameter("platform_radius")] = parameters[0] / 2;
    }
    const Index closures = info().closures;
    RowMatrix all(120 * closures, parameters.size());
    for (Index row = 0; row < all.rows();) {
      State state{parameters, random_pose(random, 2), 1, 0};
      state.reading = reading(state, 1);
      if (margin(state) > 0.05) {
        const ClosureRows rows = linearise(state);
        all.middleRows(row, closures) = rows.by_parameters / rows.by_reading[0];
        row += closures;
      }
    }
    const auto rank = [](RowMatrix rows) {
      for (Index i = 0; i < rows.cols(); ++i) {
        rows.col(i) /= rows.col(i).norm();
      }
      const Vector values = Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues();
      return (values.array() > 1e-6 * values[0]).count();
    };
    const std::vector<Index> estimated =
        estimated_parameters(info(), parameters.transpose()).front();
    EXPECT_EQ(rank(all(Eigen::all, estimated)), static_cast<Index>(estimated.size()));
    // A pulley's radius, which is given, can be estimated too.
    EXPECT_EQ(rank(all), static_cast<Index>(estimated.size()) + (is_pulley() ? 1 : 0));
  }
}

TEST_P(Spatial, DrawingLeadsFromTheBasePointOverTheInnerJointToThePlatformPoint) {
  for (const State& state : spatial_states(20)) {
    const RowMatrix joints = joint_centres(state);
    ASSERT_EQ(joints.cols(), 3);
    ASSERT_EQ(joints.rows(), has_two() || is_pulley() ? 3 : 2);
    if (!moves()) {
      EXPECT_TRUE(joints.rowwise().norm().isOnes(1e-12));
      EXPECT_NEAR(joints.row(0).dot(joints.row(1)), std::cos(parameter(state, "proximal_arc")),
                  1e-12);
      EXPECT_NEAR(joints.row(1).dot(joints.row(2)), std::cos(parameter(state, "distal_arc")),
                  1e-12);
    } else if (has_two()) {
      const double first = (joints.row(1) - joints.row(0)).norm();
      const double crank = parameter(state, "proximal_length");
      EXPECT_NEAR(first, crank > 0 ? crank : std::abs(active_joint(state)), 1e-12);
      EXPECT_NEAR((joints.row(2) - joints.row(1)).norm(), parameter(state, "distal_length"), 1e-11);
    } else if (is_pulley()) {
      expect_cable_drawn(state, joints);
    } else {
      EXPECT_NEAR((joints.row(1) - joints.row(0)).norm(), active_joint(state), 1e-12);
    }
    if (GetParam().platform == Platform::translating) {
      EXPECT_TRUE(joints.bottomRows(1).isApprox(state.pose, 1e-12));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Chains, Spatial, ::testing::ValuesIn(every_spatial_chain()), test_name);

// Both chains at the same poses: their readings with that radius, and with none.
std::array<double, 2> with_and_without(Platform platform, double radius, Random& random) {
  const ChainModel& cable = leg_model("U[P]S", platform);
  const ChainModel& pulley = leg_model("U[P]S pulley", platform);
  Vector parameters(cable.parameter_count());
  for (double& value : parameters) {
    value = 0.5 + random.uniform();
  }
  Vector own(parameters.size() + 1);
  own << radius, parameters;
  RowMatrix pose = RowMatrix::Random(1, coordinate_count(cable.info().pose_space));
  if (platform == Platform::rigid) {
    pose.rightCols<4>().normalize();
  }
  std::array<Vector, 2> readings{Vector(1), Vector(1)};
  cable.inverse_kinematics(parameters, 1, pose, readings[0]);
  pulley.inverse_kinematics(own, 1, pose, readings[1]);
  return {readings[0][0], readings[1][0]};
}

TEST(Pulley, OfNoRadiusIsAPlainCable) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    for (const Platform platform : {Platform::rigid, Platform::translating}) {
      const auto [plain, pulley] = with_and_without(platform, 0, random);
      EXPECT_NEAR(plain, pulley, 1e-12);
    }
  }
}

// Its centre 0.2 m beside the axis: level with it the cable goes a quarter round and is a tangent
// of Pythagoras' length; straight down from its far side, half round; straight up along the axis,
// not round at all.
TEST(Pulley, HasTheCableOfSimpleTriangles) {
  const ChainModel& model = leg_model("U[P]S pulley", Platform::translating);
  Vector parameters(6);
  parameters << 0.2, 1, kPi / 2, 0, 1, 0;  // A = (1, 0, 0)
  const auto length = [&](double x, double z) {
    RowMatrix pose(1, 3);
    pose << x, 0, z;
    Vector reading(1);
    model.inverse_kinematics(parameters, 1, pose, reading);
    return reading[0];
  };
  EXPECT_NEAR(length(2.2, 0.2), 0.2 * kPi / 2 + 1, 1e-14);
  EXPECT_NEAR(length(1.4, -3), 0.2 * kPi + 3, 1e-14);
  EXPECT_NEAR(length(1, 3), 3, 1e-12);
  EXPECT_NEAR(length(-0.2, 0.2), 0.2 * kPi / 2 + 1, 1e-14);
  EXPECT_TRUE(std::isnan(length(1.3, 0)));
}

TEST(Pulley, IsSmoothAboveItsAxis) {
  const ChainModel& model = leg_model("U[P]S pulley", Platform::translating);
  Vector parameters(6);
  parameters << 0.2, 1, kPi / 2, 0, 1, 0;
  RowMatrix pose(1, 3);
  pose << 1, 0, 3;
  ClosureRows rows;
  model.linearise(parameters, pose, Vector::Constant(1, 3), rows);
  EXPECT_NEAR(rows.by_pose(0, 0), 0, 1e-9);
  EXPECT_NEAR(rows.by_pose(0, 1), 0, 1e-9);
  EXPECT_NEAR(rows.by_pose(0, 2), 1, 1e-9);
}

std::string_view held_of(double guide_azimuth, double elevation, double swing) {
  const ChainInfo& info = leg_model("[P]US", Platform::translating).info();
  Vector parameters(9);
  parameters << 1, 0.5, 0.3, 0.1, guide_azimuth, elevation, swing, 1, 0;
  const std::vector<Index> estimated = estimated_parameters(info, parameters.transpose()).front();
  EXPECT_EQ(estimated.size(), 7U);
  for (Index i = 0; i < 9; ++i) {
    if (i != 4 && std::find(estimated.begin(), estimated.end(), i) == estimated.end()) {
      return info.parameters[static_cast<std::size_t>(i)].name;
    }
  }
  return "";
}

TEST(HeldParameter, IsTheBasePointsCoordinateAlongWhichTheGuideRunsMost) {
  constexpr double kBase = 0.3;
  EXPECT_EQ(held_of(kBase, kPi / 2, 0), "base_height");
  EXPECT_EQ(held_of(kBase, 0, 0), "base_radius");
  EXPECT_EQ(held_of(kBase, 0, kPi / 2), "base_azimuth");
  EXPECT_EQ(held_of(kBase + kPi / 2, 0, 0), "base_azimuth");
  EXPECT_EQ(held_of(kBase, 0.8, 0), "base_height");
  EXPECT_EQ(held_of(kBase, 0.7, 0), "base_radius");
}

TEST(HeldParameter, IsTheHeightOfDrivenLegsThatSwingInPlanesBetweenEqualCircles) {
  const ChainInfo& info = leg_model("R[P]S").info();
  RowMatrix parameters(3, 11);
  parameters << 0.5, 0.1, 0, 0.1, 0, 0, 0.5, 0.2, 0, 1, 0,  //
      0.51, 2.1, 0, 2.1, 0, 0, 0.49, 2.2, 0, 1, 0,          //
      0.49, 4.1, 0, 4.1, 0, 0, 0.51, 4.2, 0, 1, 0;
  const std::vector<Index> without_height{0, 1, 4, 5, 6, 7, 8, 9, 10};
  for (const std::vector<Index>& leg : estimated_parameters(info, parameters)) {
    EXPECT_EQ(leg, without_height);
  }
  parameters.col(6).setConstant(0.3);
  for (const std::vector<Index>& leg : estimated_parameters(info, parameters)) {
    EXPECT_EQ(leg.size(), 10U);
  }
}

TEST(HeldParameter, IsTheHeightOnATie) {
  EXPECT_EQ(held_of(0.3, kPi / 4, 0), "base_height");
  EXPECT_EQ(held_of(0.3 + kPi / 2, kPi / 4, 0), "base_height");
}

}  // namespace
}  // namespace symkin::testing
