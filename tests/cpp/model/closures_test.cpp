// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "symkin/chains/planar.hpp"
#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// R[P]: a pivot at the base point A in a slider on a guide of the platform, which the leg leaves
// two degrees of freedom. q is the travel along n' = n(phi + beta_b) from the guide's foot.
// Closures (m): n' . (A - r) - q and, u' = u(phi + beta_b), distance of A from the guide  u' . (A -
// r) - ob.
struct SliderOnPlatform
    : PlanarLeg<kBaseRadius, kBaseAngle, kPlatformGuideDistance, kPlatformGuideAngle> {
  static constexpr int kClosures = 2;
  static constexpr std::string_view kName = "R[P]";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_platform;
  static constexpr bool kModeIsOrientation = false;
  static constexpr std::string_view kWorkingMode = "without meaning";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    const auto to_pivot = polar(OA, beta) - position(pose);
    auto along = dot(normal(pose.phi + beta_b), to_pivot) - q;
    using H = decltype(along);  // of the second alone it would not be, where q alone is a jet
    return std::array<H, 2>{along, H(dot(direction(pose.phi + beta_b), to_pivot) - ob)};
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& /*mode*/) {
    return closure<T>(geometry, pose, T(0.0)).front();
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double /*q*/) {
    const auto& [OA, beta, ob, beta_b] = geometry;
    const Vec2<double> pivot = polar(OA, beta);
    return centres(pivot, pivot, platform_point(pose, ob, beta_b));
  }
};

// The same leg, its second closure with a share of the first: the reading shows in both.
struct SharedReading : SliderOnPlatform {
  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    auto [along, across] = SliderOnPlatform::closure<G>(geometry, pose, q);
    using H = decltype(along);
    return std::array<H, 2>{along, H(across + (pose.x - 0.4) * along)};
  }
};

const ChainModel& model() {
  static const LegModelOf<SliderOnPlatform> instance;
  return instance;
}

const ChainModel& shared_model() {
  static const LegModelOf<SharedReading> instance;
  return instance;
}

const Vector kParameters = (Vector(6) << 0.8, 2.1, -0.3, 0.6, 1.3, 0.2).finished();
const Vector kReadings = (Vector(3) << 0.4, -0.7, 1.1).finished();

// Poses at which the leg shows the readings: r = A - ob u' - q n'.
RowMatrix closed_poses() {
  RowMatrix poses(3, 3);
  for (Index i = 0; i < 3; ++i) {
    const double phi = 0.9 * static_cast<double>(i) - 0.5;
    const double guide = phi + kParameters[3];
    const double q = kParameters[4] * kReadings[i] + kParameters[5];
    poses(i, 0) = kParameters[0] * std::cos(kParameters[1]) - kParameters[2] * std::cos(guide) +
                  q * std::sin(guide);
    poses(i, 1) = kParameters[0] * std::sin(kParameters[1]) - kParameters[2] * std::sin(guide) -
                  q * std::cos(guide);
    poses(i, 2) = phi;
  }
  return poses;
}

// Off the closed state, so that no derivative vanishes.
RowMatrix open_poses() { return closed_poses().array() + 0.05; }

Vector closures(const Vector& parameters, const RowMatrix& poses, const Vector& readings) {
  Vector values(2 * poses.rows());
  model().closure(parameters, poses, readings, values);
  return values;
}

TEST(TwoClosures, AreZeroAtTruthWhereInverseKinematicsGivesTheReading) {
  EXPECT_EQ(model().info().closures, 2);
  EXPECT_LT(closures(kParameters, closed_poses(), kReadings).cwiseAbs().maxCoeff(), 1e-15);
  Vector readings(3);
  model().inverse_kinematics(kParameters, 1, closed_poses(), readings);
  EXPECT_LT((readings - kReadings).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(TwoClosures, HaveTheDerivativesThatDifferencesShow) {
  constexpr double kStep = 1e-6;
  ClosureRows rows;
  model().linearise(kParameters, open_poses(), kReadings, rows);
  EXPECT_EQ(rows.closure, closures(kParameters, open_poses(), kReadings));
  const auto expect_column = [](const Vector& derivative, const Vector& ahead,
                                const Vector& behind) {
    EXPECT_LT((derivative - (ahead - behind) / (2 * kStep)).cwiseAbs().maxCoeff(), 1e-9);
  };
  for (Index i = 0; i < kParameters.size(); ++i) {
    const Vector step = kStep * Vector::Unit(kParameters.size(), i);
    expect_column(rows.by_parameters.col(i), closures(kParameters + step, open_poses(), kReadings),
                  closures(kParameters - step, open_poses(), kReadings));
  }
  for (Index i = 0; i < 3; ++i) {
    const RowMatrix step = kStep * Vector::Ones(3) * Vector::Unit(3, i).transpose();
    expect_column(rows.by_pose.col(i), closures(kParameters, open_poses() + step, kReadings),
                  closures(kParameters, open_poses() - step, kReadings));
  }
  expect_column(rows.by_reading, closures(kParameters, open_poses(), kReadings.array() + kStep),
                closures(kParameters, open_poses(), kReadings.array() - kStep));
  ClosureRows by_pose;
  model().linearise_pose(kParameters, open_poses(), kReadings, by_pose);
  EXPECT_LT((by_pose.by_pose - rows.by_pose).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((by_pose.by_reading - rows.by_reading).cwiseAbs().maxCoeff(), 1e-15);
}

void expect_whitened_together(const ChainModel& model) {
  MeasurementNoise noise;
  noise.reading = 3e-4;
  RowMatrix parameters(2, 6);
  parameters << kParameters.transpose(), 0.7, -0.4, 0.2, 2.6, -0.9, 0.1;
  RowMatrix readings(3, 2);
  readings << kReadings, kReadings.reverse();
  readings(1, 0) = std::numeric_limits<double>::quiet_NaN();  // a pose of one leg alone
  const MeasurementSet measurements{open_poses(), readings, {-1, -1, -1}};
  const Mechanism mechanism("2-RP", model, {{kParameters, 1}, {parameters.row(1).transpose(), 1}});
  const WhitenedClosures system =
      whiten_closures(mechanism, measurements, {0, 1}, noise, LinearisedAt::measured);
  ASSERT_EQ(system.residual.size(), 4 + 2 + 4);
  ASSERT_EQ(system.jacobian.cols(), 12);
  const WhitenedPose& last = system.poses.back();
  Vector h(4);
  Eigen::MatrixXd by_pose(4, 3);
  Eigen::MatrixXd by_reading = Eigen::MatrixXd::Zero(4, 2);
  Eigen::MatrixXd by_parameters = Eigen::MatrixXd::Zero(4, 12);
  for (Index leg = 0; leg < 2; ++leg) {
    ClosureRows rows;
    model.linearise(parameters.row(leg).transpose(), open_poses().row(2),
                    readings.col(leg).tail<1>(), rows);
    h.segment(2 * leg, 2) = rows.closure;
    by_pose.middleRows(2 * leg, 2) = rows.by_pose;
    by_reading.block(2 * leg, leg, 2, 1) = rows.by_reading;
    by_parameters.block(2 * leg, 6 * leg, 2, 6) = rows.by_parameters;
  }
  const Eigen::MatrixXd covariance =
      by_pose * noise.pose_variances(PoseSpace::planar).asDiagonal() * by_pose.transpose() +
      noise.reading * noise.reading * by_reading * by_reading.transpose();
  const Eigen::MatrixXd factor = last.units.inverse();
  EXPECT_LT((factor * factor.transpose() - covariance).norm(), 1e-15);
  EXPECT_LT((factor * system.residual.tail(4) - h).norm(), 1e-14);
  EXPECT_LT((factor * system.jacobian.bottomRows(4) - by_parameters).norm(), 1e-13);
}

TEST(TwoClosures, AreWhitenedWithTheErrorOfTheReadingThatTheyShare) {
  expect_whitened_together(model());
}

TEST(TwoClosures, AreWhitenedWhereTheReadingShowsInBoth) {
  ClosureRows rows;
  shared_model().linearise(kParameters, open_poses(), kReadings, rows);
  for (Index i = 0; i < 3; ++i) {
    EXPECT_GT(std::abs(rows.by_reading[2 * i + 1]), 0.1 * std::abs(rows.by_reading[2 * i]));
  }
  expect_whitened_together(shared_model());
}

TEST(TwoClosures, KeepTheirSizesUnderEverySymmetry) {
  SymmetryFrame frame;
  frame.base_centre = {0.3, -0.2};
  frame.platform_centre = {-0.05, 0.1};
  frame.base_axis = 0.4;
  frame.platform_axis = -0.9;
  const SymmetryGroup group(5, true, frame);
  const Vector expected = closures(kParameters, open_poses(), kReadings).cwiseAbs();
  for (const SymmetryElement element : group.elements()) {
    const Leg image = transform_leg(group, element, model().info(), {kParameters, 1});
    const double sign = reading_sign(element, model().info().active_joint);
    const Vector values =
        closures(image.parameters, transform_poses(group, element, PoseSpace::planar, open_poses()),
                 sign * kReadings);
    EXPECT_LT((values.cwiseAbs() - expected).cwiseAbs().maxCoeff(), 1e-13)
        << SymmetryGroup::label(element);
  }
}

// What is left of the second closure once the reading follows the pose and the parameters.
TEST(TwoClosures, PartFromTheReadingByTheFirst) {
  ClosureRows rows;
  model().linearise(kParameters, open_poses(), kReadings, rows);
  ClosureRows parted = rows;
  // Of a reading that shows in both.
  for (Index i = 0; i < 3; ++i) {
    for (auto* const each : {&rows, &parted}) {
      each->closure[2 * i + 1] += 0.3 * each->closure[2 * i];
      each->by_parameters.row(2 * i + 1) += 0.3 * each->by_parameters.row(2 * i);
      each->by_pose.row(2 * i + 1) += 0.3 * each->by_pose.row(2 * i);
      each->by_reading[2 * i + 1] += 0.3 * each->by_reading[2 * i];
    }
  }
  parted.eliminate_reading(2);
  ClosureRows own;
  model().linearise(kParameters, open_poses(), kReadings, own);
  for (Index i = 0; i < 6; ++i) {
    EXPECT_NEAR(parted.closure[i], own.closure[i], 1e-14);
    EXPECT_LT((parted.by_parameters.row(i) - own.by_parameters.row(i)).norm(), 1e-14);
    EXPECT_LT((parted.by_pose.row(i) - own.by_pose.row(i)).norm(), 1e-14);
    EXPECT_NEAR(parted.by_reading[i], i % 2 == 0 ? own.by_reading[i] : 0, 1e-14);
  }
}

TEST(TwoClosures, AreRefusedByEstimatorsThatKnowALegByItsReadingAlone) {
  const Mechanism mechanism("2-RP", model(), {{kParameters, 1}, {kParameters, 1}});
  const RowMatrix poses = closed_poses();
  EXPECT_EQ(closure(mechanism, 0, poses, kReadings).size(), 6);
  const MeasurementSet measurements{poses, inverse_kinematics(mechanism, poses), {-1, -1, -1}};
  for (const Estimator estimator : {Estimator::paper, Estimator::inverse}) {
    IdentificationOptions options;
    options.estimator = estimator;
    try {
      identify(mechanism, measurements, options);
      ADD_FAILURE() << "accepted";
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("chain R[P] have 2 closures"), std::string::npos)
          << error.what();
    }
  }
}

TEST(TwoClosures, BringTwoRowsAPoseWhichAreWhitenedTogether) {
  const Mechanism mechanism("2-RP", model(), {{kParameters, 1}, {kParameters, 1}});
  const RowMatrix poses = closed_poses();
  MeasurementNoise noise;
  noise.reading = 3e-4;
  const RowMatrix rows = observability_rows(mechanism, 1, poses, RowKind::noise_aware, noise);
  ASSERT_EQ(rows.rows(), 6);
  ClosureRows own;
  model().linearise(kParameters, poses, kReadings, own);
  for (Index i = 0; i < 3; ++i) {
    const Eigen::MatrixXd by_pose = own.by_pose.middleRows(2 * i, 2);
    const Vector by_reading = own.by_reading.segment(2 * i, 2);
    const Eigen::MatrixXd covariance =
        by_pose * noise.pose_variances(PoseSpace::planar).asDiagonal() * by_pose.transpose() +
        noise.reading * noise.reading * by_reading * by_reading.transpose();
    const Eigen::MatrixXd expected = own.by_parameters.middleRows(2 * i, 2).transpose() *
                                     covariance.inverse() * own.by_parameters.middleRows(2 * i, 2);
    const Eigen::MatrixXd found = rows.middleRows(2 * i, 2).transpose() * rows.middleRows(2 * i, 2);
    EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());
  }
}

}  // namespace
}  // namespace symkin
