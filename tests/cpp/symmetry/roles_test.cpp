// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>

#include "support/mechanisms.hpp"
#include "symkin/chains/planar.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/leg_model_of.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/detection.hpp"
#include "symkin/symmetry/generation.hpp"

namespace symkin {
namespace {

constexpr ParameterInfo kPivotFar{"how_far", {End::base, ParameterKind::radius}};
constexpr ParameterInfo kPivotWhere{"where", {End::base, ParameterKind::azimuth}};
constexpr ParameterInfo kSlope{"slope", {End::base, ParameterKind::direction_azimuth}};

// [P]RR whose guide is known by a point A of it and the direction of its normal, each an azimuth of
// the base, under names that no other chain has. q is the travel along n(slope) from A. Closure
// (m): |b - A - q n(slope)| - L.  Working mode: sign of n(slope) . (distal link).
struct GuideThroughAPoint
    : PlanarLeg<kDistalLength, kPivotFar, kPivotWhere, kSlope, kPlatformRadius, kPlatformAngle> {
  static constexpr std::string_view kName = "[P]RR, by a point";
  static constexpr ActiveJoint kActiveJoint = ActiveJoint::travel_on_base;
  static constexpr bool kModeIsOrientation = true;
  static constexpr std::string_view kWorkingMode = "sign of n(slope) . (distal link)";

  template <typename G, typename T, typename Q>
  static auto closure(const Geometry<G>& geometry, const Pose<T>& pose, const Q& q) {
    const auto& [L, OA, where, slope, ob, beta_b] = geometry;
    return norm(leg_vector(pose, OA, where, ob, beta_b) - q * normal(slope)) - L;
  }

  template <typename T>
  static T root(const Geometry<T>& geometry, const Pose<T>& pose, const T& mode) {
    const auto& [L, OA, where, slope, ob, beta_b] = geometry;
    const Vec2<T> d = leg_vector(pose, OA, where, ob, beta_b);
    return dot(normal(slope), d) - mode * triangle_leg(L, dot(direction(slope), d));
  }

  template <typename T>
  static T reach_margin(const Geometry<T>& /*geometry*/, const Pose<T>& /*pose*/) {
    return T(kUnlimitedReach);
  }

  static JointCentres joint_centres(const Geometry<double>& geometry, const Pose<double>& pose,
                                    double q) {
    const auto& [L, OA, where, slope, ob, beta_b] = geometry;
    const Vec2<double> point = polar(OA, where);
    return centres(point, point + q * normal(slope), platform_point(pose, ob, beta_b));
  }
};

// The directions lean away from the points' azimuths, to either side in the legs of a pair.
Mechanism guides_through_points() {
  static const LegModelOf<GuideThroughAPoint> model;
  Vector parameters(8);
  parameters << 1.2, 0.9, 0.4, 0.7, 0.25, 0.5, 1.1, 0.3;
  const SymmetryGroup group = SymmetryGroup::named("D3", 0.2);
  return {"guides", model,
          generate_legs(group, model, {parameters, -1}, generating_elements(group, 6))};
}

RowMatrix some_poses() {
  RowMatrix poses(3, 3);
  poses << 0.02, 0.05, 0.1, -0.06, 0.01, -0.2, 0.03, -0.04, 0.05;
  return poses;
}

SymmetryFrame shifted_frame() {
  SymmetryFrame frame;
  frame.base_centre = {0.3, -0.2};
  frame.platform_centre = {-0.05, 0.1};
  frame.base_axis = 0.4;
  frame.platform_axis = -0.9;
  return frame;
}

TEST(Roles, CarryAPointAndADirectionOfOneEndWhateverTheirNamesAre) {
  const Mechanism mechanism = guides_through_points();
  const ChainInfo& chain = mechanism.model(0).info();
  const RowMatrix readings = inverse_kinematics(mechanism, some_poses());
  ASSERT_TRUE(readings.allFinite());
  for (const SymmetryGroup& group :
       {SymmetryGroup::named("D3", 0.2), SymmetryGroup(5, true, shifted_frame())}) {
    for (const SymmetryElement element : group.elements()) {
      std::vector<Leg> legs;
      for (const Leg& leg : mechanism.legs()) {
        legs.push_back(transform_leg(group, element, chain, leg));
      }
      const RowMatrix image_readings =
          inverse_kinematics({"image", *mechanism.chain(), legs},
                             transform_poses(group, element, PoseSpace::planar, some_poses()));
      const double sign = reading_sign(element, chain.active_joint);
      EXPECT_LT((image_readings - sign * readings).cwiseAbs().maxCoeff(), 1e-13)
          << SymmetryGroup::label(element);
    }
  }
}

TEST(Roles, ShowDetectionADirectionThatIsOff) {
  const Mechanism mechanism = guides_through_points();
  EXPECT_EQ(detect_symmetry(mechanism).structure.name(), "D_3");
  RowMatrix parameters = mechanism.parameters();
  parameters(2, 3) += 1e-3;
  const Mechanism off = mechanism.with_parameters(parameters);
  EXPECT_EQ(detect_symmetry(off).structure.name(), "C_1");
  const ElementImage image = image_of_legs(off, SymmetryGroup::named("C3"), {1, false});
  EXPECT_FALSE(image.keeps_structure);
  EXPECT_EQ(image.deviations[0].parameter, "slope");
  EXPECT_NEAR(std::abs(image.deviations[0].deviation), 1e-3, 1e-12);
}

TEST(Roles, LetAPointAndADirectionBeWrittenEachInItsOwnWay) {
  const Mechanism mechanism = guides_through_points();
  std::vector<Leg> legs = mechanism.legs();
  // The point on the other side of the origin.
  legs[0].parameters[1] *= -1;
  legs[0].parameters[2] += kPi;
  // The guide with its normal turned round, and with it its travel and what it calls ahead.
  legs[3].parameters[3] -= kPi;
  legs[3].parameters.tail<2>() *= -1;
  legs[3].working_mode *= -1;
  const Mechanism rewritten("rewritten", *mechanism.chain(), legs);
  EXPECT_LT(
      (inverse_kinematics(rewritten, some_poses()) - inverse_kinematics(mechanism, some_poses()))
          .cwiseAbs()
          .maxCoeff(),
      1e-13);
  const DetectedSymmetry found = detect_symmetry(rewritten);
  EXPECT_EQ(found.structure.name(), "D_3");
  EXPECT_EQ(found.with_modes.name(), detect_symmetry(mechanism).with_modes.name());
}

}  // namespace
}  // namespace symkin
