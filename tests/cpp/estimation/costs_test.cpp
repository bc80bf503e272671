// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/costs.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"

namespace symkin {
namespace {

std::vector<std::unique_ptr<ceres::CostFunction>> closures_at(const Mechanism& mechanism,
                                                              const RowMatrix& pose,
                                                              double reading_error) {
  const RowMatrix readings = inverse_kinematics(mechanism, pose).array() + reading_error;
  std::vector<std::unique_ptr<ceres::CostFunction>> costs;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    costs.push_back(std::move(mechanism.model().closure_costs(pose, readings.col(leg)).front()));
  }
  return costs;
}

const RowMatrix kPose = (RowMatrix(1, 3) << 0.1, 0.05, 0.2).finished();

TEST(JointCost, IsZeroAtTruthAndItsDerivativesEqualDifferences) {
  const Mechanism mechanism = testing::paper_3rrr();
  Eigen::MatrixXd whitening(3, 3);
  whitening << 100, 0, 0, -20, 90, 0, 5, -30, 80;
  const JointCost exact(closures_at(mechanism, kPose, 0), whitening);
  std::vector<Vector> values;
  std::vector<const double*> blocks;
  for (const Leg& leg : mechanism.legs()) {
    values.push_back(leg.parameters);
  }
  for (const Vector& value : values) {
    blocks.push_back(value.data());
  }
  Vector residuals(3);
  exact.Evaluate(blocks.data(), residuals.data(), nullptr);
  EXPECT_LT(residuals.cwiseAbs().maxCoeff(), 1e-12);

  const JointCost off(closures_at(mechanism, kPose, 0.05), whitening);
  std::vector<RowMatrix> jacobians(3, RowMatrix(3, 8));
  double* rows[] = {jacobians[0].data(), jacobians[1].data(), jacobians[2].data()};
  off.Evaluate(blocks.data(), residuals.data(), rows);
  constexpr double kStep = 1e-5;
  for (std::size_t leg = 0; leg < 3; ++leg) {
    for (Index i = 0; i < 8; ++i) {
      const double value = values[leg][i];
      Vector ahead(3);
      Vector behind(3);
      values[leg][i] = value + kStep;
      off.Evaluate(blocks.data(), ahead.data(), nullptr);
      values[leg][i] = value - kStep;
      off.Evaluate(blocks.data(), behind.data(), nullptr);
      values[leg][i] = value;
      const Vector difference = (ahead - behind) / (2 * kStep);
      EXPECT_LT((jacobians[leg].col(i) - difference).norm(), 1e-6 * (1 + difference.norm()));
    }
  }
}

}  // namespace
}  // namespace symkin
