// SPDX-License-Identifier: MIT
#include "symkin/kinematics/inverse_kinematics.hpp"

#include <gtest/gtest.h>
#include <Eigen/SVD>
#include <limits>

#include "support/mechanisms.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

struct Case {
  const char* name;
  Mechanism mechanism;
  WorkspaceOptions workspace;
};

class Kinematics : public ::testing::TestWithParam<Case> {
 protected:
  RowMatrix poses(Index count) const {
    return sample_workspace(GetParam().mechanism, GetParam().workspace, count, 5).poses;
  }
  const Mechanism& mechanism() const { return GetParam().mechanism; }
};

INSTANTIATE_TEST_SUITE_P(
    Mechanisms, Kinematics,
    ::testing::Values(Case{"Planar", testing::paper_3rrr(), testing::paper_workspace()},
                      Case{"Spatial", testing::hexapod(), testing::hexapod_workspace()}),
    [](const auto& info) { return std::string(info.param.name); });

TEST_P(Kinematics, ReadingsOfTheInverseKinematicsCloseEveryLeg) {
  const RowMatrix at = poses(50);
  const RowMatrix readings = inverse_kinematics(mechanism(), at);
  for (Index leg = 0; leg < mechanism().leg_count(); ++leg) {
    EXPECT_LT(closure(mechanism(), leg, at, readings.col(leg)).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST_P(Kinematics, PoseJacobianEqualsCentralDifferencesOnTheTangent) {
  const RowMatrix at = poses(20);
  const RowMatrix jacobian = pose_jacobian(mechanism(), at);
  const Index dof = mechanism().dof();
  constexpr double kStep = 1e-6;
  for (Index k = 0; k < dof; ++k) {
    RowMatrix ahead = at;
    RowMatrix behind = at;
    Vector step = Vector::Zero(dof);
    for (Index i = 0; i < at.rows(); ++i) {
      step[k] = kStep;
      move_pose(mechanism().pose_space(), step.data(), ahead.row(i).data());
      step[k] = -kStep;
      move_pose(mechanism().pose_space(), step.data(), behind.row(i).data());
    }
    const RowMatrix difference =
        (inverse_kinematics(mechanism(), ahead) - inverse_kinematics(mechanism(), behind)) /
        (2 * kStep);
    for (Index leg = 0; leg < mechanism().leg_count(); ++leg) {
      const double scale = 1 + difference.col(leg).cwiseAbs().maxCoeff();
      EXPECT_LT((jacobian.col(leg * dof + k) - difference.col(leg)).cwiseAbs().maxCoeff(),
                1e-7 * scale);
    }
  }
}

TEST_P(Kinematics, ParameterJacobianEqualsCentralDifferences) {
  const RowMatrix at = poses(20);
  const RowMatrix jacobian = parameter_jacobian(mechanism(), 1, at);
  for (Index k = 0; k < mechanism().parameter_count(); ++k) {
    const double step = 1e-6 * std::max(0.01, std::abs(mechanism().parameters()(1, k)));
    RowMatrix ahead = mechanism().parameters();
    ahead(1, k) += step;
    RowMatrix behind = mechanism().parameters();
    behind(1, k) -= step;
    const Vector difference = (inverse_kinematics(mechanism().with_parameters(ahead), at) -
                               inverse_kinematics(mechanism().with_parameters(behind), at))
                                  .col(1) /
                              (2 * step);
    const double scale = 1 + difference.cwiseAbs().maxCoeff();
    EXPECT_LT((jacobian.col(k) - difference).cwiseAbs().maxCoeff(), 1e-6 * scale) << k;
  }
}

TEST(KinematicsOf3Rrr, GivesNaNForALegOutOfReachAndNumbersForTheOthers) {
  const RowMatrix pose = (RowMatrix(1, 3) << 1.5, 0.87, 0.0).finished();
  const RowMatrix readings = inverse_kinematics(testing::paper_3rrr(), pose);
  EXPECT_TRUE(std::isnan(readings(0, 0)));
  EXPECT_TRUE(std::isfinite(readings(0, 1)));
}

TEST(KinematicsOf3Rrr, AgreesWithARigidBodySimulator) {
  // Crank angles in the base frame from an independent body tree; base corners at 210, 330 and 90
  // degrees, pose (0.3, -0.2, 15 degrees), to the eight decimals that were published.
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix pose = (RowMatrix(1, 3) << 0.3, -0.2, 15 * M_PI / 180).finished();
  const RowMatrix readings = inverse_kinematics(mechanism, pose);
  const double published[] = {37.65024225, 185.5702522, -69.00212221};
  for (Index leg = 0; leg < 3; ++leg) {
    const double offset = mechanism.leg(leg).parameters[7];
    const double crank = readings(0, leg) + offset;
    EXPECT_NEAR(wrap_angle(crank - published[leg] * M_PI / 180), 0, 1e-7) << leg;
  }
}

TEST(KinematicsOf3Rrr, IsParallelSingularWhereTheDistalLinksMeetInTheCentre) {
  // With the platform in the centre each distal link points at it when elbow, platform point and
  // centre are in line: the triangle of base radius, proximal link and L + platform radius gives
  // the angle, 0.359 rad, to one side with each working mode.
  const double base = 6 / std::sqrt(3.0);
  const double elbow = 1.5 + 1.5 / std::sqrt(3.0);
  const double angle = std::acos((base * base + elbow * elbow - 1.5 * 1.5) / (2 * base * elbow));
  for (const int mode : {-1, 1}) {
    const Mechanism mechanism = testing::paper_3rrr(mode);
    const auto determinant = [&](double phi) {
      const RowMatrix pose = (RowMatrix(1, 3) << 0, 0, phi).finished();
      return singularity_measures(mechanism, pose, 1).parallel[0];
    };
    EXPECT_LT(determinant(mode * angle - 1e-6) * determinant(mode * angle + 1e-6), 0) << mode;
    EXPECT_LT(std::abs(determinant(mode * angle)), 1e-9) << mode;
  }
}

TEST(KinematicsOf3Rrr, RefusesPosesOfAnotherKind) {
  EXPECT_THROW(inverse_kinematics(testing::paper_3rrr(), RowMatrix::Zero(2, 2)), InvalidInput);
}

TEST(KinematicsOf3Rrr, RefusesReadingsThatAreNotOneAPose) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = RowMatrix::Zero(5, 3);
  for (const Index count : {0, 1, 4, 6}) {
    const Vector readings = Vector::Zero(count);
    EXPECT_THROW(closure(mechanism, 0, poses, readings), InvalidInput) << count;
    EXPECT_THROW(linearise(mechanism, 0, poses, readings), InvalidInput) << count;
  }
}

// A Jacobian of n rows, row by row in one row of a matrix.
RowMatrix jacobian_row(const RowMatrix& jacobian) {
  return Eigen::Map<const RowMatrix>(jacobian.data(), 1, jacobian.size());
}

TEST(Condition, IsTheRatioOfTheSingularValues) {
  Random random(4);
  for (const auto& [space, dof] : {std::pair{PoseSpace::point, 2}, std::pair{PoseSpace::planar, 3},
                                   std::pair{PoseSpace::spatial, 6}}) {
    for (const Index rows : {Index{dof}, Index{dof + 1}}) {
      RowMatrix jacobians(5, rows * dof);  // as no number of lanes divides it
      for (double& element : jacobians.reshaped()) {
        element = random.normal();
      }
      const Vector conditions = pose_conditions(jacobians, Vector::Ones(rows), space, 1);
      for (Index i = 0; i < jacobians.rows(); ++i) {
        const Eigen::Map<const RowMatrix> jacobian(jacobians.row(i).data(), rows, dof);
        const Vector values = Eigen::JacobiSVD<Eigen::MatrixXd>(jacobian).singularValues();
        EXPECT_NEAR(conditions[i] * values[dof - 1] / values[0], 1, 1e-10) << to_string(space);
      }
    }
  }
}

TEST(Condition, IsOneOfAnIsotropicJacobianInfiniteOfNoneAndNotANumberWithoutNumbers) {
  const auto condition = [](const RowMatrix& jacobian) {
    return pose_conditions(jacobian_row(jacobian), Vector::Ones(3), PoseSpace::planar, 1)[0];
  };
  EXPECT_NEAR(condition(2.5 * RowMatrix::Identity(3, 3)), 1, 1e-12);
  EXPECT_NEAR(condition(Eigen::Vector3d(2, 1, 1).asDiagonal()), 2, 1e-7);
  EXPECT_NEAR(condition(Eigen::Vector3d(2, 2, 1).asDiagonal()), 2, 1e-7);
  EXPECT_GT(condition(Eigen::Vector3d(2, 1, 0).asDiagonal()), 1e7);
  EXPECT_EQ(condition(RowMatrix::Zero(3, 3)), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(condition(RowMatrix::Constant(3, 3, std::nan("")))));
  EXPECT_TRUE(
      std::isnan(condition(RowMatrix::Constant(3, 3, std::numeric_limits<double>::infinity()))));
}

TEST(InverseKinematics, CountsAnglesFromHomeWhereverTheZeroIs) {
  const Mechanism nominal = testing::paper_3rrr();
  const Vector home = Vector::Zero(3);
  const RowMatrix poses = sample_workspace(nominal, testing::paper_workspace(), 500, 2).poses;
  const RowMatrix expected = inverse_kinematics(nominal, poses);
  for (const double zero : {3.66, -2.9, 1.0}) {
    RowMatrix parameters = nominal.parameters();
    parameters.col(7).array() += zero;
    const Mechanism moved = counted_from(nominal.with_parameters(parameters), home);
    const RowMatrix apart =
        (expected - inverse_kinematics(moved, poses)).array() - zero;  // whole turns
    const double turns = std::round(apart(0, 0) / (2 * kPi));
    EXPECT_LT((apart.array() - 2 * kPi * turns).abs().maxCoeff(), 1e-12) << zero;
  }
}

TEST(InverseKinematics, HalfATurnAtHomeIsCountedThereWhateverTheErrorsAre) {
  const Mechanism nominal = testing::paper_3rrr();
  const Vector home = Vector::Zero(3);
  for (const double error : {1e-3, -1e-3}) {
    RowMatrix parameters = nominal.parameters();
    parameters.col(7).array() += inverse_kinematics(nominal, home.transpose())(0, 0) - kPi + error;
    const Mechanism robot = counted_from(nominal.with_parameters(parameters), home);
    EXPECT_NEAR(inverse_kinematics(robot, home.transpose())(0, 0), kPi - error, 1e-9);
  }
}

}  // namespace
}  // namespace symkin
