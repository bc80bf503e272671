// SPDX-License-Identifier: MIT
#include "symkin/model/sensor.hpp"

#include <gtest/gtest.h>

#include "support/bent_sensor.hpp"
#include "symkin/chains/rpr.hpp"
#include "symkin/model/leg_model_of.hpp"

namespace symkin {
namespace {

const LegModelOf<RprActive2, testing::BentSensor> kModel;
const Vector kParameters = (Vector(7) << 0.8, 2.1, 0.3, 0.6, 0.9, 0.2, 0.4).finished();
const RowMatrix kPoses = (RowMatrix(2, 3) << 0.5, 0.2, 0.1, -0.3, 0.4, -0.7).finished();

TEST(SensorOfAnotherLaw, BringsItsParametersBehindTheLegs) {
  ASSERT_EQ(kModel.parameter_count(), 7);
  EXPECT_EQ(kModel.info().parameters[3].name, "platform_angle");
  EXPECT_EQ(kModel.info().parameters[5].name, "bend");
}

TEST(SensorOfAnotherLaw, ClosesTheLegWithItsOwnDerivatives) {
  Vector readings(2);
  Vector values(2);
  kModel.inverse_kinematics(kParameters, 1, kPoses, readings);
  kModel.closure(kParameters, kPoses, readings, values);
  EXPECT_LT(values.cwiseAbs().maxCoeff(), 1e-15);

  constexpr double kStep = 1e-6;
  ClosureRows rows;
  kModel.linearise(kParameters, kPoses, readings, rows);
  const auto closure = [&](const Vector& parameters, double psi_step) {
    Vector h(2);
    kModel.closure(parameters, kPoses, readings.array() + psi_step, h);
    return h;
  };
  for (Index i = 0; i < 7; ++i) {
    const Vector step = kStep * Vector::Unit(7, i);
    const Vector difference = closure(kParameters + step, 0) - closure(kParameters - step, 0);
    EXPECT_LT((rows.by_parameters.col(i) - difference / (2 * kStep)).norm(), 1e-9);
  }
  const Vector difference = closure(kParameters, kStep) - closure(kParameters, -kStep);
  EXPECT_LT((rows.by_reading - difference / (2 * kStep)).norm(), 1e-9);
  // dh/dq is -1 for a distance.
  EXPECT_DOUBLE_EQ(kModel.sensor_gain(kParameters, readings[0]), -rows.by_reading[0]);
}

TEST(SensorOfAnotherLaw, IsWhatTheReadingIsDifferentiatedBy) {
  Vector readings(2);
  kModel.inverse_kinematics(kParameters, 1, kPoses, readings);
  ClosureRows rows;
  kModel.linearise(kParameters, kPoses, readings, rows);
  constexpr double kStep = 1e-6;
  for (Index i = 0; i < 7; ++i) {
    Vector ahead(2);
    Vector behind(2);
    const Vector step = kStep * Vector::Unit(7, i);
    kModel.inverse_kinematics(kParameters + step, 1, kPoses, ahead);
    kModel.inverse_kinematics(kParameters - step, 1, kPoses, behind);
    const Vector gradient = -rows.by_parameters.col(i).cwiseQuotient(rows.by_reading);
    EXPECT_LT((gradient - (ahead - behind) / (2 * kStep)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(LinearSensor, ComparesAnglesByTheShortestTurn) {
  const double parameters[] = {-2, 0.3};
  const LinearSensor sensor(parameters);
  const double turn = 3.14159265358979323846;  // of the sensor: two radians are one of the reading
  EXPECT_NEAR(sensor.difference(0.1 + turn, 0.3, true), -0.2, 1e-15);
  EXPECT_NEAR(sensor.difference(0.1 + turn, 0.3, false), turn - 0.2, 1e-15);
  EXPECT_NEAR(sensor.reading(sensor.active_joint(0.7) + 2 * turn, true), 0.7, 1e-15);
}

}  // namespace
}  // namespace symkin
