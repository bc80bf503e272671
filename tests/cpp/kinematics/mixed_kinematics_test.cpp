// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/mixed_mechanisms.hpp"
#include "support/poses.hpp"
#include "symkin/chains/rrr.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

RowMatrix moved(const Mechanism& mechanism, RowMatrix poses, const Vector& step) {
  for (Index i = 0; i < poses.rows(); ++i) {
    move_pose(mechanism.pose_space(), step.data(), poses.row(i).data());
  }
  return poses;
}

// The same legs, of one chain that is there twice: a copy with the same kernels.
struct Twins {
  LegModelOf<RrrActive1> other{dynamic_cast<const LegModelOf<RrrActive1>&>(leg_model("[R]RR"))};
  Mechanism alike, mixed;

  explicit Twins(const Mechanism& mechanism)
      : alike(mechanism), mixed("mixed", chains(mechanism), mechanism.legs()) {}

  std::vector<const ChainModel*> chains(const Mechanism& mechanism) const {
    std::vector<const ChainModel*> all(mechanism.legs().size(), mechanism.chain());
    all.back() = &other;
    return all;
  }
};

TEST(MixedKinematics, ClosesEveryLegWhereTheInverseKinematicsPutsIt) {
  for (const auto& [mechanism, workspace] : testing::all_mixed()) {
    const WorkspaceSample sample = sample_workspace(mechanism, workspace, 50, 3);
    EXPECT_EQ(inverse_kinematics(mechanism, sample.poses), sample.readings);
    EXPECT_GT(reach_margin(mechanism, sample.poses).minCoeff(), 0);
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      EXPECT_LT(
          closure(mechanism, leg, sample.poses, sample.readings.col(leg)).lpNorm<Eigen::Infinity>(),
          1e-12)
          << mechanism.name() << leg;
    }
  }
}

TEST(MixedKinematics, UndoesTheInverseKinematicsFromANeighbouringStart) {
  for (const auto& [mechanism, workspace] : testing::all_mixed()) {
    const WorkspaceSample sample = sample_workspace(mechanism, workspace, 600, 3);
    const RowMatrix start = moved(mechanism, sample.poses, Vector::Constant(mechanism.dof(), 0.01));
    const auto result = forward_kinematics(mechanism, sample.readings, start);
    EXPECT_EQ(result.converged_count(), 600) << mechanism.name();
    EXPECT_LT(testing::worst_difference(mechanism, result.poses, sample.poses), 1e-11)
        << mechanism.name();
  }
}

TEST(MixedKinematics, HasTheDerivativesThatDifferencesShow) {
  constexpr double kStep = 1e-6;
  for (const auto& [mechanism, workspace] : testing::all_mixed()) {
    const WorkspaceSample sample = sample_workspace(mechanism, workspace, 5, 3);
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const Vector readings = sample.readings.col(leg);
      const ClosureRows rows = linearise(mechanism, leg, sample.poses, readings);
      const auto by = [&](const Vector& ahead, const Vector& behind) {
        return Vector((ahead - behind) / (2 * kStep));
      };
      for (Index i = 0; i < mechanism.parameter_count(); ++i) {
        const auto at = [&](double step) {
          RowMatrix parameters = mechanism.parameters();
          parameters(leg, i) += step;
          return closure(mechanism.with_parameters(parameters), leg, sample.poses, readings);
        };
        EXPECT_LT((by(at(kStep), at(-kStep)) - rows.by_parameters.col(i)).norm(), 1e-8);
      }
      for (Index i = 0; i < mechanism.dof(); ++i) {
        const auto at = [&](double step) {
          const Vector along = step * Vector::Unit(mechanism.dof(), i);
          return closure(mechanism, leg, moved(mechanism, sample.poses, along), readings);
        };
        EXPECT_LT((by(at(kStep), at(-kStep)) - rows.by_pose.col(i)).norm(), 1e-8);
      }
      const auto at = [&](double step) {
        return closure(mechanism, leg, sample.poses, readings.array() + step);
      };
      EXPECT_LT((by(at(kStep), at(-kStep)) - rows.by_reading).norm(), 1e-8);
    }
  }
}

TEST(MixedKinematics, OfLegsThatAreAlikeIsThatOfTheirChain) {
  const Twins twins(testing::paper_3rrr());
  ASSERT_TRUE(twins.mixed.mixed());
  const WorkspaceOptions workspace = testing::paper_workspace();
  const WorkspaceSample sample = sample_workspace(twins.alike, workspace, 300, 3);
  EXPECT_EQ(sample_workspace(twins.mixed, workspace, 300, 3).poses, sample.poses);
  EXPECT_EQ(inverse_kinematics(twins.mixed, sample.poses), sample.readings);
  EXPECT_EQ(reach_margin(twins.mixed, sample.poses), reach_margin(twins.alike, sample.poses));
  EXPECT_EQ(pose_jacobian(twins.mixed, sample.poses), pose_jacobian(twins.alike, sample.poses));
  const auto expected = singularity_measures(twins.alike, sample.poses, 1.3);
  const auto measures = singularity_measures(twins.mixed, sample.poses, 1.3);
  EXPECT_EQ(measures.serial, expected.serial);
  EXPECT_EQ(measures.condition, expected.condition);
}

// From far away too, where readings are missing, where nothing closes, and in other modes.
TEST(MixedKinematics, FindsThePosesThatTheChainFinds) {
  std::vector<Leg> four = testing::paper_3rrr().legs();
  four.push_back(four.front());
  four.back().parameters[3] += 0.3;
  four.back().parameters[5] += 0.3;
  const Mechanism redundant("4-RRR", leg_model("[R]RR"), four);
  for (const Mechanism& mechanism : {testing::paper_3rrr(), testing::paper_3rrr(1), redundant}) {
    const Twins twins(mechanism);
    const WorkspaceSample sample = sample_workspace(mechanism, testing::paper_workspace(), 400, 3);
    RowMatrix readings = sample.readings;
    readings(7, 1) = std::numeric_limits<double>::quiet_NaN();
    for (Index i = 100; i < 200; ++i) {
      readings(i, i % mechanism.leg_count()) += 1.5;
    }
    RowMatrix start = RowMatrix::Zero(400, 3);
    start.bottomRows(100).col(2).setConstant(2.8);
    start.row(350) << 30, 0, 0;
    const auto expected = forward_kinematics(twins.alike, readings, start);
    const auto result = forward_kinematics(twins.mixed, readings, start);
    EXPECT_EQ(result.status, expected.status);
    EXPECT_GT(expected.converged_count(), 100);
    EXPECT_LT(expected.converged_count(), 400);
    EXPECT_TRUE((result.poses.array().isNaN() == expected.poses.array().isNaN()).all());
    for (Index i = 0; i < 400; ++i) {
      if (expected.status[static_cast<std::size_t>(i)] == ForwardStatus::converged) {
        EXPECT_LT((result.poses.row(i) - expected.poses.row(i)).norm(), 1e-12) << i;
      }
    }
    ForwardKinematicsOptions one;
    one.max_iterations = 1;
    EXPECT_EQ(forward_kinematics(twins.mixed, readings, start, one).status,
              forward_kinematics(twins.alike, readings, start, one).status);
  }
}

TEST(MixedKinematics, TakesMoreLegsThanDegreesOfFreedom) {
  const auto [three, workspace] = testing::cranks_and_slider();
  std::vector<const ChainModel*> chains{&leg_model("[R]RR"), &leg_model("[R]RR"),
                                        &leg_model("[P]RR"), &leg_model("[P]RR")};
  std::vector<Leg> legs = three.legs();
  legs.push_back(legs.back());
  legs.back().parameters[3] += 2.5;
  legs.back().parameters[5] += 2.5;
  legs.back().working_mode = 1;
  const Mechanism four("four", chains, legs);
  EXPECT_TRUE(four.redundant());
  const WorkspaceSample sample = sample_workspace(four, workspace, 100, 3);
  const RowMatrix start = moved(four, sample.poses, Vector::Constant(3, 0.01));
  const auto result = forward_kinematics(four, sample.readings, start);
  EXPECT_EQ(result.converged_count(), 100);
  EXPECT_LT(testing::worst_difference(four, result.poses, sample.poses), 1e-9);
}

TEST(MixedKinematics, TellsAnotherWorkingModeFromItsOwn) {
  const Mechanism mechanism = testing::cranks_and_slider().mechanism;
  for (Index leg = 0; leg < 3; ++leg) {
    std::vector<Leg> legs = mechanism.legs();
    int& mode = legs[static_cast<std::size_t>(leg)].working_mode;
    mode = -mode;
    const Mechanism other = mechanism.with_legs(legs);
    const RowMatrix pose = Eigen::RowVector3d(0.1, 0.05, 0.1);  // home is singular in some
    const RowMatrix readings = inverse_kinematics(other, pose);
    const auto own = forward_kinematics(other, readings, pose);
    EXPECT_EQ(own.status[0], ForwardStatus::converged);
    const auto wrong = forward_kinematics(mechanism, readings, pose);
    EXPECT_EQ(wrong.status[0], ForwardStatus::left_aspect) << leg;
  }
}

TEST(MixedKinematics, IsConditionedInOneUnitWhereSomeJointsTurnAndOthersTravel) {
  const auto [mechanism, workspace] = testing::cranks_and_slider();
  const WorkspaceSample sample = sample_workspace(mechanism, workspace, 20, 3);
  const Vector expected = singularity_measures(mechanism, sample.poses, 1.3).condition;
  // Drawn in other units of length.
  constexpr double kScale = 1000;
  RowMatrix parameters = mechanism.parameters();
  parameters.col(0) *= kScale;
  parameters.col(1) *= kScale;
  parameters.col(2) *= kScale;
  parameters.col(4) *= kScale;
  parameters(2, 7) *= kScale;
  RowMatrix poses = sample.poses;
  poses.leftCols(2) *= kScale;
  const Vector found =
      singularity_measures(mechanism.with_parameters(parameters), poses, 1.3 * kScale).condition;
  EXPECT_LT((found.cwiseQuotient(expected).array() - 1).abs().maxCoeff(), 1e-6);
}

TEST(MixedKinematics, HasLimitsOfReadingsForEachLeg) {
  auto [mechanism, workspace] = testing::cranks_and_slider();
  const WorkspaceSample all = sample_workspace(mechanism, workspace, 200, 3);
  const double infinity = std::numeric_limits<double>::infinity();
  workspace.reading_upper = Vector::Constant(3, infinity);
  workspace.reading_upper[2] = all.readings.col(2).mean();
  const auto inside = inside_workspace(mechanism, workspace, all.poses);
  for (Index i = 0; i < 200; ++i) {
    EXPECT_EQ(inside[static_cast<std::size_t>(i)],
              all.readings(i, 2) <= workspace.reading_upper[2]);
  }
  workspace.reading_upper = Vector::Constant(2, infinity);
  EXPECT_THROW(inside_workspace(mechanism, workspace, all.poses), InvalidInput);
}

}  // namespace
}  // namespace symkin
