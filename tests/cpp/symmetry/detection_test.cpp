// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detection.hpp"

#include <gtest/gtest.h>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/random.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// A leg of any planar chain with its platform, not special in any parameter.
Leg generic_leg(const ChainModel& model) {
  Random random(3);
  Leg leg{Vector(model.parameter_count()), -1};
  for (Index i = 0; i < leg.parameters.size(); ++i) {
    leg.parameters[i] = 0.5 + random.uniform();
  }
  return leg;
}

Mechanism generated(const std::string& chain, Platform platform, const SymmetryGroup& group,
                    Index count) {
  const ChainModel& model = leg_model(chain, platform);
  return {chain, model,
          generate_legs(group, model, generic_leg(model), generating_elements(group, count))};
}

// Six legs at least, or a platform that never turns.
bool in_space(const std::string& chain) {
  return position_size(leg_model(chain).info().pose_space) == 3;
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
    if (in_space(chain)) {
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
    if (in_space(chain)) {
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
    if (in_space(chain)) {
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

TEST(SymmetryDetection, FindsTheGroupsOfLegsInSpaceAboutAnyCentreAndAxisWithTheirModes) {
  SymmetryFrame shifted = SymmetryFrame::about_origin(0.3);
  shifted.base_centre = {0.7, -0.4};
  for (const std::string& chain : chain_names(Platform::translating)) {
    for (int order = 3; order <= 6; ++order) {
      const auto turned =
          detect_symmetry(generated(chain, Platform::translating, {order, false, shifted}, order));
      // A leg that is known by a point alone is its own mirror image.
      EXPECT_EQ(turned.structure.name(),
                (chain.substr(0, 5) == "U[P]S" ? "D_" : "C_") + std::to_string(order))
          << chain;
      const auto mirrored = detect_symmetry(
          generated(chain, Platform::translating, {order, true, shifted}, 2 * order));
      EXPECT_EQ(mirrored.structure.name(), "D_" + std::to_string(order)) << chain;
      EXPECT_EQ(mirrored.with_modes.name(), "D_" + std::to_string(order)) << chain;
      const auto rigid =
          detect_symmetry(generated(chain, Platform::rigid, {order, true, anywhere()}, 2 * order));
      EXPECT_EQ(rigid.structure.name(), "D_" + std::to_string(order)) << chain;
      EXPECT_EQ(rigid.with_modes.name(), "D_" + std::to_string(order)) << chain;
    }
  }
}

TEST(SymmetryDetection, FindsTheGroupsOfLegsOnASphereWithAPlaneOfItsOwnForEachEnd) {
  SymmetryFrame planes;
  planes.base_axis = 0.3;
  planes.platform_axis = 1.1;
  for (int order = 3; order <= 6; ++order) {
    const auto turned =
        detect_symmetry(generated("[R]RR", Platform::spherical, {order, false, planes}, order));
    EXPECT_EQ(turned.structure.rotations(), order);
    EXPECT_EQ(turned.with_modes.name(), "C_" + std::to_string(order));
    const auto mirrored =
        detect_symmetry(generated("[R]RR", Platform::spherical, {order, true, planes}, 2 * order));
    EXPECT_EQ(mirrored.structure.name(), "D_" + std::to_string(order));
    EXPECT_EQ(mirrored.with_modes.name(), "D_" + std::to_string(order));
  }
}

TEST(SymmetryDetection, AcceptsADirectionInSpaceWrittenTheOtherWayRound) {
  for (const std::string chain : {"[P]US", "[R]US"}) {
    const Mechanism delta =
        generated(chain, Platform::translating, SymmetryGroup::named("D3", 0.3), 6);
    const ChainInfo& info = delta.model(0).info();
    const auto place = [&](ParameterKind kind) {
      return static_cast<Index>(info.find({End::base, kind}));
    };
    std::vector<Leg> legs = delta.legs();
    const bool guide = chain == "[P]US";
    const Index swing = place(guide ? ParameterKind::guide_swing : ParameterKind::axis_swing);
    legs[3].parameters[place(guide ? ParameterKind::guide_elevation
                                   : ParameterKind::axis_elevation)] += kPi;
    legs[3].parameters[swing] *= -1;
    legs[3].parameters.tail<2>() *= -1;
    legs[3].working_mode *= -1;
    const Mechanism rewritten("rewritten", *delta.chain(), legs);
    // Most poses are beyond the reach of some leg.
    Random random(4);
    const RowMatrix poses =
        RowMatrix::NullaryExpr(2000, 3, [&] { return 6 * random.uniform() - 3; });
    const Vector readings = inverse_kinematics(rewritten, poses).col(3);
    const Vector expected = inverse_kinematics(delta, poses).col(3);
    Index reached = 0;
    for (Index i = 0; i < poses.rows(); ++i) {
      ASSERT_EQ(std::isfinite(readings[i]), std::isfinite(expected[i]));
      if (std::isfinite(expected[i])) {
        EXPECT_NEAR(readings[i], expected[i], 1e-12);
        ++reached;
      }
    }
    EXPECT_GT(reached, 10);
    EXPECT_EQ(detect_symmetry(rewritten).with_modes.name(), "D_3") << chain;
    legs[3].parameters[swing] += 1e-3;
    EXPECT_EQ(detect_symmetry({"off", *delta.chain(), legs}).structure.name(), "C_1") << chain;
  }
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
