// SPDX-License-Identifier: MIT
#include "symkin/model/leg_constraint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "symkin/chains/point_platform.hpp"
#include "symkin/chains/prs.hpp"
#include "symkin/chains/rpr.hpp"
#include "symkin/chains/rrr.hpp"
#include "symkin/chains/rus.hpp"
#include "symkin/chains/spherical.hpp"
#include "symkin/chains/ups.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/model/pose_manifold.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

// An encoder off its axis, q = gain (psi + a sin psi) + offset.
struct EccentricSensor {
  static constexpr int kParameters = 3;
  static constexpr std::array<ParameterInfo, kParameters> kParameterInfos{
      {{"gain", {End::none, ParameterKind::gain}},
       {"offset", {End::none, ParameterKind::offset}},
       {"eccentricity", {End::none, ParameterKind::curvature}}}};

  explicit EccentricSensor(const double* parameters)
      : gain(parameters[0]), offset(parameters[1]), a(parameters[2]) {}

  double active_joint(double psi) const { return gain * (psi + a * std::sin(psi)) + offset; }
  double by_reading(double psi) const { return gain * (1 + a * std::cos(psi)); }
  std::array<double, kParameters> by_parameters(double psi) const {
    return {psi + a * std::sin(psi), 1, gain * std::sin(psi)};
  }
  double reading(double q, bool /*angular*/) const { return (q - offset) / gain; }
  double difference(double reading, double other, bool /*angular*/) const {
    return reading - other;
  }

  double gain, offset, a;
};

template <typename LegType, typename SensorType = LinearSensor>
struct Sensed {
  using Leg = LegType;
  using Sensor = SensorType;
};

template <typename Case>
class LegConstraintOf : public ::testing::Test {
 protected:
  using Constraint = LegConstraint<typename Case::Leg, typename Case::Sensor>;
  using Model = LegModelOf<typename Case::Leg, typename Case::Sensor>;

  // Residuals and derivatives of a cost function at random values of its blocks.
  struct Evaluated {
    std::vector<double> residuals;
    std::vector<std::vector<double>> jacobians;
  };

  static std::vector<std::vector<double>> random_blocks(Random& random) {
    std::vector<std::vector<double>> blocks;
    for (const int size : {Constraint::kParameters, Constraint::kCoordinates, 1}) {
      std::vector<double>& block = blocks.emplace_back();
      for (int i = 0; i < size; ++i) {
        block.push_back(0.3 + random.uniform());
      }
    }
    return blocks;
  }

  static Evaluated evaluate(const ceres::CostFunction& cost,
                            const std::vector<std::vector<double>>& blocks) {
    Evaluated result;
    result.residuals.resize(static_cast<std::size_t>(cost.num_residuals()));
    std::vector<const double*> values;
    std::vector<double*> jacobians;
    for (const auto& block : blocks) {
      values.push_back(block.data());
      result.jacobians.emplace_back(block.size() * result.residuals.size());
    }
    for (auto& jacobian : result.jacobians) {
      jacobians.push_back(jacobian.data());
    }
    EXPECT_TRUE(cost.Evaluate(values.data(), result.residuals.data(), jacobians.data()));
    return result;
  }
};

using Cases = ::testing::Types<Sensed<RrrActive1>, Sensed<PointPlatform<RrrActive1>>,
                               Sensed<RprActive2, EccentricSensor>, Sensed<OnRigid<UpsActive2>>,
                               Sensed<OnTranslating<RusActive1>>, Sensed<OnRigid<PrsActive1>>,
                               Sensed<SphericalRrrActive1>>;
TYPED_TEST_SUITE(LegConstraintOf, Cases);

TYPED_TEST(LegConstraintOf, IsTheSameWhetherTheChainIsKnownToTheCompilerOrAtRunTime) {
  const typename TestFixture::Model model;
  const std::unique_ptr<ceres::CostFunction> of_model = model.constraint();
  const std::unique_ptr<ceres::CostFunction> of_struct(TestFixture::Constraint::create());
  ASSERT_EQ(of_model->parameter_block_sizes(), of_struct->parameter_block_sizes());
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const auto blocks = TestFixture::random_blocks(random);
    const auto expected = TestFixture::evaluate(*of_struct, blocks);
    const auto found = TestFixture::evaluate(*of_model, blocks);
    for (std::size_t i = 0; i < expected.residuals.size(); ++i) {
      EXPECT_NEAR(found.residuals[i], expected.residuals[i], 1e-13);
    }
    for (std::size_t block = 0; block < blocks.size(); ++block) {
      for (std::size_t i = 0; i < expected.jacobians[block].size(); ++i) {
        const double derivative = expected.jacobians[block][i];
        EXPECT_NEAR(found.jacobians[block][i], derivative, 1e-12 * (1 + std::abs(derivative)))
            << "block " << block << ", element " << i;
      }
    }
  }
}

TYPED_TEST(LegConstraintOf, HasTheDerivativesOfItsResiduals) {
  const std::unique_ptr<ceres::CostFunction> cost(TestFixture::Constraint::create());
  Random random(2);
  const auto blocks = TestFixture::random_blocks(random);
  const auto at = TestFixture::evaluate(*cost, blocks);
  for (std::size_t block = 0; block < blocks.size(); ++block) {
    for (std::size_t i = 0; i < blocks[block].size(); ++i) {
      constexpr double kStep = 1e-6;
      auto ahead = blocks;
      auto behind = blocks;
      ahead[block][i] += kStep;
      behind[block][i] -= kStep;
      const auto after = TestFixture::evaluate(*cost, ahead);
      const auto before = TestFixture::evaluate(*cost, behind);
      for (std::size_t k = 0; k < at.residuals.size(); ++k) {
        EXPECT_NEAR(at.jacobians[block][k * blocks[block].size() + i],
                    (after.residuals[k] - before.residuals[k]) / (2 * kStep), 1e-7);
      }
    }
  }
}

TEST(PoseManifold, HasTheDegreesOfFreedomOfItsSpaceAndKeepsQuaternionsOfLengthOne) {
  for (const PoseSpace space : {PoseSpace::spatial, PoseSpace::spherical}) {
    const auto manifold = pose_manifold(space);
    ASSERT_NE(manifold, nullptr);
    EXPECT_EQ(manifold->AmbientSize(), coordinate_count(space));
    EXPECT_EQ(manifold->TangentSize(), degrees_of_freedom(space));
    const Vector pose = identity_pose(space);
    const Vector step = Vector::LinSpaced(degrees_of_freedom(space), -0.4, 0.5);
    Vector moved(pose.size());
    ASSERT_TRUE(manifold->Plus(pose.data(), step.data(), moved.data()));
    EXPECT_NEAR(moved.tail(4).norm(), 1, 1e-15);
  }
  for (const PoseSpace space : {PoseSpace::planar, PoseSpace::point, PoseSpace::translating}) {
    EXPECT_EQ(pose_manifold(space), nullptr);
  }
}

}  // namespace
}  // namespace symkin
