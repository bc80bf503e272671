// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detection.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/support/random.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// A leg of any planar chain with its platform, not special in any parameter.
Leg generic_leg(const LegModel& model) {
  Random random(3);
  Leg leg{Vector(model.parameter_count()), -1};
  for (Index i = 0; i < leg.parameters.size(); ++i) {
    leg.parameters[i] = 0.5 + random.uniform();
  }
  return leg;
}

Mechanism generated(const std::string& chain, Platform platform, const SymmetryGroup& group,
                    Index count) {
  const LegModel& model = leg_model(chain, platform);
  return {chain, model,
          generate_legs(group, model, generic_leg(model), generating_elements(group, count))};
}

SymmetryFrame anywhere() {
  SymmetryFrame frame;
  frame.base_centre = {0.7, -0.4};
  frame.platform_centre = {0.1, 0.25};
  frame.base_axis = 0.3;
  frame.platform_axis = 1.1;
  return frame;
}

TEST(SymmetryDetection, FindsEveryRotationGroupOfEveryChainAboutAnyCentre) {
  for (const std::string& chain : chain_names()) {
    if (chain == "U[P]S") {
      continue;
    }
    for (int order = 3; order <= 6; ++order) {
      const SymmetryGroup group(order, false, anywhere());
      const DetectedSymmetry found =
          detect_symmetry(generated(chain, Platform::rigid, group, order));
      EXPECT_EQ(found.structure.rotations(), order) << chain;
      EXPECT_EQ(found.with_modes.rotations(), order) << chain;
    }
  }
}

TEST(SymmetryDetection, FindsEveryDihedralGroupOfEveryChainAboutAnyCentreAndAxis) {
  for (const std::string& chain : chain_names()) {
    if (chain == "U[P]S") {
      continue;
    }
    for (int order = 2; order <= 3; ++order) {
      const SymmetryGroup group(order, true, anywhere());
      const DetectedSymmetry found =
          detect_symmetry(generated(chain, Platform::rigid, group, 2 * order));
      EXPECT_EQ(found.with_modes.name(), group.name()) << chain;
    }
  }
}

TEST(SymmetryDetection, FindsTheMirrorOfAFiveBar) {
  const DetectedSymmetry found = detect_symmetry(testing::five_bar());
  EXPECT_EQ(found.with_modes.name(), "D_1");
  EXPECT_NEAR(found.with_modes.frame().base_axis, M_PI / 2, 1e-12);
  EXPECT_EQ(found.images[1].permutation, (std::vector<Index>{1, 0}));
}

TEST(SymmetryDetection, TheStructureOfThe3RrrHasReflectionsThatFlipItsModes) {
  const DetectedSymmetry found = detect_symmetry(testing::paper_3rrr());
  EXPECT_EQ(found.structure.paper_name(), "D_6");
  EXPECT_EQ(found.with_modes.name(), "C_3");
}

TEST(SymmetryDetection, FindsD3OfTheHexapodWithAllLegsInOneOrbit) {
  const Mechanism hexapod = testing::hexapod();
  const DetectedSymmetry found = detect_symmetry(hexapod);
  EXPECT_EQ(found.with_modes.name(), "D_3");
  for (const Carrier& carrier : leg_carriers(hexapod, found.with_modes)) {
    EXPECT_EQ(carrier.reference, 0);
  }
}

TEST(SymmetryDetection, SeesThroughErrorsWithinTheToleranceAndNotBeyond) {
  RowMatrix parameters = testing::paper_3rrr().parameters();
  Random random(5);
  for (Index i = 0; i < parameters.size(); ++i) {
    parameters.data()[i] += 1e-3 * random.normal();
  }
  const Mechanism made = testing::paper_3rrr().with_parameters(parameters);
  EXPECT_EQ(detect_symmetry(made).structure.name(), "C_1");
  EXPECT_EQ(detect_symmetry(made, {0.02, 0.02, 0.02}).structure.name(), "D_3");
}

// Every parameter of the structure off by the whole tolerance, up or down; the sensors by anything.
Mechanism with_errors(const Mechanism& drawing, double tolerance, Random& random) {
  RowMatrix parameters = drawing.parameters();
  const Index structure = parameters.cols() - 2;
  for (Index leg = 0; leg < parameters.rows(); ++leg) {
    for (Index i = 0; i < structure; ++i) {
      parameters(leg, i) += random.uniform() < 0.5 ? -tolerance : tolerance;
    }
    parameters(leg, structure) *= 1 + random.uniform();
    parameters(leg, structure + 1) += random.uniform();
  }
  return drawing.with_parameters(parameters);
}

TEST(SymmetryDetection, FindsWhatErrorsUpToTheToleranceHideInEveryChainWhateverItsSensors) {
  Random random(8);
  for (const std::string& chain : chain_names()) {
    if (chain == "U[P]S") {
      continue;
    }
    for (const SymmetryGroup& group :
         {SymmetryGroup::named("C3"), SymmetryGroup::named("C5"), SymmetryGroup::named("D2", 0.4),
          SymmetryGroup::named("D3", 0.4), SymmetryGroup(4, false, anywhere()),
          SymmetryGroup(3, true, anywhere())}) {
      const Mechanism drawing = generated(chain, Platform::rigid, group, group.size());
      for (int made = 0; made < 4; ++made) {
        const Mechanism robot = with_errors(drawing, 1e-4, random);
        const SymmetryGroup found = detect_symmetry(robot, {1e-4, 1e-4, 1e-4}).with_modes;
        EXPECT_EQ(found.rotations(), group.rotations()) << chain << " " << group.name();
        EXPECT_GE(found.size(), group.size()) << chain << " " << group.name();
      }
    }
  }
}

TEST(SymmetryDetection, FindsWhatErrorsUpToTheToleranceHideInAHexapod) {
  Random random(8);
  for (int made = 0; made < 20; ++made) {
    const Mechanism robot = with_errors(testing::hexapod(), 1e-6, random);
    EXPECT_EQ(detect_symmetry(robot).with_modes.name(), "D_3");
  }
}

TEST(SymmetryDetection, AnAsymmetricMechanismIsTrivial) {
  RowMatrix parameters = testing::paper_3rrr().parameters();
  parameters(1, 0) += 0.1;
  parameters(2, 3) += 0.2;
  const DetectedSymmetry found = detect_symmetry(testing::paper_3rrr().with_parameters(parameters));
  EXPECT_EQ(found.structure.name(), "C_1");
}

TEST(SymmetryDetection, NamesTheLegAndTheParameterThatBreakTheSymmetry) {
  RowMatrix parameters = testing::paper_3rrr().parameters();
  parameters(1, 4) += 0.003;
  const Mechanism broken = testing::paper_3rrr().with_parameters(parameters);
  const RowMatrix deviations =
      symmetry_deviations(broken, SymmetryGroup::named("C3"), {0.1, 0.1, 0.1});
  RowMatrix expected = RowMatrix::Zero(3, 8);
  expected(1, 4) = 0.003;
  EXPECT_LT((deviations - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(SymmetryDetection, GivesTheErrorOfAMirroredLegTheSignThatItHasThere) {
  const Mechanism hexapod = testing::hexapod();
  const SymmetryGroup group = detect_symmetry(hexapod).with_modes;
  for (const Index parameter : {0, 2, 5, 7}) {  // radius, both azimuths, offset
    RowMatrix parameters = hexapod.parameters();
    parameters(1, parameter) += 0.003;
    const RowMatrix deviations =
        symmetry_deviations(hexapod.with_parameters(parameters), group, {0.1, 0.1, 0.1});
    EXPECT_NEAR(deviations(1, parameter), 0.003, 1e-12) << parameter;
  }
}

TEST(SymmetryDetection, UsesTheElementThatFitsBestHoweverLooseTheTolerance) {
  const Mechanism hexapod = testing::hexapod();
  const SymmetryGroup group = detect_symmetry(hexapod).with_modes;
  const RowMatrix deviations = symmetry_deviations(hexapod, group, {10, 10, 10});
  EXPECT_LT(deviations.cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace symkin
