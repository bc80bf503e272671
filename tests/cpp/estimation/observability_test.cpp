// SPDX-License-Identifier: MIT
#include "symkin/estimation/observability.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/verification.hpp"

namespace symkin {
namespace {

struct Case {
  const char* name;
  Mechanism mechanism;
  WorkspaceOptions workspace;
  SymmetryGroup group;
};

class SymmetricalObservability : public ::testing::TestWithParam<Case> {
 protected:
  // Largest relative deviation of |R_ii| of all legs at the mapped poses (Eq. 10).
  static double deviation(const Mechanism& mechanism, RowKind kind) {
    const Case& example = GetParam();
    const RowMatrix poses = sample_workspace(example.mechanism, example.workspace, 24, 4).poses;
    const auto carriers = observability_group(example.mechanism, example.group);
    Vector reference;
    double worst = 0;
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const RowMatrix mapped = transform_poses(
          example.group, carriers[static_cast<std::size_t>(leg)], mechanism.pose_space(), poses);
      const Vector scale = Vector::Ones(mechanism.parameter_count());
      const Vector diagonal =
          analyse_observability(observability_rows(mechanism, leg, mapped, kind), scale).r_diagonal;
      reference = leg == 0 ? diagonal : reference;
      worst =
          std::max(worst, ((diagonal - reference).array() / reference.array()).abs().maxCoeff());
    }
    return worst;
  }
};

INSTANTIATE_TEST_SUITE_P(
    Mechanisms, SymmetricalObservability,
    ::testing::Values(Case{"Planar", testing::paper_3rrr(), testing::paper_workspace(),
                           SymmetryGroup::named("C3")},
                      Case{"Spatial", testing::hexapod(), testing::hexapod_workspace(),
                           SymmetryGroup::named("D3", 210 * M_PI / 180)}),
    [](const auto& info) { return std::string(info.param.name); });

TEST_P(SymmetricalObservability, HoldsToRoundingForTheNominalMechanism) {
  EXPECT_LT(deviation(GetParam().mechanism, RowKind::paper), 1e-10);
  EXPECT_LT(deviation(GetParam().mechanism, RowKind::noise_aware), 1e-10);
}

TEST_P(SymmetricalObservability, FailsVisiblyWhenALegIsPerturbed) {
  RowMatrix parameters = GetParam().mechanism.parameters();
  parameters(1, 0) *= 1.01;
  EXPECT_GT(deviation(GetParam().mechanism.with_parameters(parameters), RowKind::paper), 1e-4);
}

TEST(Observability, NamesTheDirectionThatNoRowShows) {
  // The third column is the sum of the first two.
  RowMatrix rows(6, 3);
  rows << 1, 2, 3, 0, 1, 1, 2, 0, 2, 1, 1, 2, 3, 1, 4, 1, 5, 6;
  const Observability result = analyse_observability(rows, Vector::Ones(3));
  EXPECT_EQ(result.rank, 2);
  ASSERT_EQ(result.null_directions.cols(), 1);
  const Vector direction = result.null_directions.col(0) / result.null_directions(0, 0);
  EXPECT_LT((direction - Eigen::Vector3d(1, 1, -1)).norm(), 1e-12);
}

TEST(Observability, IndicesFollowTheirDefinitions) {
  RowMatrix rows = RowMatrix::Zero(4, 2);
  rows(0, 0) = 2;
  rows(1, 1) = 0.5;
  const Observability result = analyse_observability(rows, Vector::Ones(2));
  EXPECT_NEAR(result.indices[0], 1.0 / 2, 1e-15);  // sqrt(2 * 0.5) / 2, Eq. 13
  EXPECT_NEAR(result.indices[1], 0.25, 1e-15);
  EXPECT_NEAR(result.indices[2], 0.5, 1e-15);
  EXPECT_NEAR(result.indices[3], 0.125, 1e-15);
  EXPECT_NEAR(result.indices[4], 1 / (0.5 + 2), 1e-15);
  EXPECT_NEAR(result.condition, 1, 1e-15);  // free of units
}

TEST(Observability, NoiseAwareRowsAreClosuresOverTheirDeviation) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = sample_workspace(mechanism, testing::paper_workspace(), 5, 1).poses;
  const RowMatrix paper = observability_rows(mechanism, 0, poses, RowKind::paper);
  const RowMatrix aware = observability_rows(mechanism, 0, poses, RowKind::noise_aware,
                                             MeasurementNoise{1e-3, 1e-3, 0});
  // The two differ by a factor a pose, up to the sign.
  for (Index i = 0; i < 5; ++i) {
    const Vector ratio = aware.row(i).array() / paper.row(i).array();
    EXPECT_LT((ratio.array() - ratio[0]).abs().maxCoeff(), 1e-9 * std::abs(ratio[0]));
  }
}

TEST(MechanismRows, OfThePaperHoldEachLegsRowsInItsOwnColumns) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = sample_workspace(mechanism, testing::paper_workspace(), 5, 1).poses;
  const RowMatrix rows = mechanism_rows(mechanism, poses, RowKind::paper);
  for (Index leg = 0; leg < 3; ++leg) {
    const RowMatrix own = observability_rows(mechanism, leg, poses, RowKind::paper);
    for (Index i = 0; i < 5; ++i) {
      EXPECT_EQ(rows.block(3 * i + leg, 8 * leg, 1, 8), own.row(i));
      EXPECT_EQ(rows.row(3 * i + leg).squaredNorm(), own.row(i).squaredNorm());
    }
  }
}

TEST(MechanismRows, AwareOfNoiseHoldTheInformationOfTheJointEstimate) {
  const Mechanism mechanism = testing::paper_3rrr();
  const RowMatrix poses = sample_workspace(mechanism, testing::paper_workspace(), 40, 1).poses;
  IdentificationOptions options;
  options.estimator = Estimator::joint;
  options.noise = {1e-4, 3e-4, 2e-4};
  const MeasurementSet exact{poses, inverse_kinematics(mechanism, poses),
                             std::vector<Index>(40, -1)};
  const RowMatrix covariance = identify(mechanism, exact, options).covariance;
  const RowMatrix rows = mechanism_rows(mechanism, poses, RowKind::noise_aware, options.noise);
  const RowMatrix product = covariance * (rows.transpose() * rows);
  EXPECT_LT((product - RowMatrix::Identity(24, 24)).lpNorm<Eigen::Infinity>(), 1e-6);
}

TEST(MechanismRows, NeedANoiseOfTheReadingsForMoreLegsThanDegreesOfFreedom) {
  const Mechanism three = testing::paper_3rrr();
  std::vector<Leg> legs = three.legs();
  legs.push_back(legs.front());  // two legs side by side, as far as the noise is concerned
  const Mechanism four("four legs", *three.chain(), legs);
  const RowMatrix home = RowMatrix::Zero(1, 3);
  EXPECT_THROW(mechanism_rows(four, home, RowKind::noise_aware, {1e-4, 1e-4, 0}), InvalidInput);
  EXPECT_TRUE(mechanism_rows(four, home, RowKind::noise_aware, {1e-4, 1e-4, 1e-4}).allFinite());
}

TEST(MechanismRows, OfManyPosesAreThoseOfEachAloneAndNamePosesAsTheyAreCounted) {
  constexpr Index kPoses = 300;
  const Mechanism mechanism = testing::paper_3rrr();
  const WorkspaceSample sample = sample_workspace(mechanism, testing::paper_workspace(), kPoses, 1);
  RowMatrix poses = sample.poses;
  poses(7, 0) = poses(200, 0) = 1e3;  // out of reach
  const MeasurementNoise noise{1e-4, 3e-4, 2e-4};
  const RowMatrix rows = mechanism_rows(mechanism, poses, RowKind::noise_aware, noise);
  for (const Index pose : {0, 7, 127, 128, 200, 299}) {
    const RowMatrix alone =
        mechanism_rows(mechanism, poses.middleRows(pose, 1), RowKind::noise_aware, noise);
    const RowMatrix own = rows.middleRows(3 * pose, 3);
    if (pose == 7 || pose == 200) {
      EXPECT_TRUE(own.array().isNaN().all());
    } else {
      EXPECT_EQ(own, alone);
    }
  }
  // Three closures without an orientation's noise are singular wherever they are.
  poses.topRows(199).col(0).setConstant(1e3);
  try {
    mechanism_rows(mechanism, poses, RowKind::noise_aware, {1e-4, 0, 0});
    FAIL() << "expected a singular pose";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("pose 200 "), std::string::npos) << error.what();
  }
}

TEST(Observability, RefusesFewerPosesThanParameters) {
  EXPECT_THROW(analyse_observability(RowMatrix::Ones(3, 4), Vector::Ones(4)), InvalidInput);
}

}  // namespace
}  // namespace symkin
