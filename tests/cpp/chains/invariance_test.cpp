// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "chains/every_chain.hpp"

namespace symkin::testing {
namespace {

// Rotation by `angle`, or reflection about the axis at `angle`, of base and platform alike.
struct Element {
  double angle;
  bool reflection;

  double turn(double azimuth) const { return reflection ? 2 * angle - azimuth : azimuth + angle; }
  double sign() const { return reflection ? -1 : 1; }
  Eigen::Matrix2d linear() const {
    Eigen::Matrix2d matrix;
    const double columns = reflection ? 2 * angle : angle;
    matrix << std::cos(columns), -sign() * std::sin(columns), std::sin(columns),
        sign() * std::cos(columns);
    return matrix;
  }
};

// The table of actions, written from the roles that a chain gives its parameters.
class Invariance : public EveryChain {
 protected:
  double image_of_offset(const Element& element, double offset) const {
    switch (info().active_joint) {
      case ActiveJoint::angle_in_base:
      case ActiveJoint::angle_in_platform:
        return element.turn(offset);
      case ActiveJoint::elbow_angle:
      case ActiveJoint::travel_on_base:
      case ActiveJoint::travel_on_platform:
        return element.sign() * offset;
      case ActiveJoint::distance:
      case ActiveJoint::travel_from_point:  // in space, see spatial_test.cpp
      case ActiveJoint::angle_about_axis:
      case ActiveJoint::angle_from_meridian:
      case ActiveJoint::joint_turn:  // of declared legs, see declared_model_test.cpp
      case ActiveJoint::mirrored_joint_turn:
      case ActiveJoint::joint_travel:
      case ActiveJoint::mirrored_joint_travel:
        break;
    }
    return offset;
  }

  State image(const Element& element, const State& state) const {
    State result = state;
    for (Index i = 0; i < state.parameters.size(); ++i) {
      const ParameterKind kind = info().parameters[static_cast<std::size_t>(i)].role.kind;
      if (kind == ParameterKind::azimuth || kind == ParameterKind::direction_azimuth) {
        result.parameters[i] = element.turn(state.parameters[i]);
      } else if (kind == ParameterKind::offset) {
        result.parameters[i] = image_of_offset(element, state.parameters[i]);
      }
    }
    result.pose.leftCols<2>() = state.pose.leftCols<2>() * element.linear().transpose();
    if (state.pose.cols() == 3) {
      result.pose(0, 2) = element.sign() * state.pose(0, 2);
    }
    result.mode = info().mode_is_orientation && element.reflection ? -state.mode : state.mode;
    result.reading = info().active_joint == ActiveJoint::distance ? state.reading
                                                                  : element.sign() * state.reading;
    return result;
  }

  template <typename Check>
  void for_every_state_and_element(const Check& check) const {
    Random random(7);
    for (const State& state : random_states()) {
      for (const bool reflection : {false, true}) {
        check(state, Element{6 * random.uniform() - 3, reflection});
      }
    }
  }

  // By the shortest turn.
  double between_readings(const State& state, double a, double b) const {
    const double gap = gain(state) * (a - b);
    return std::abs(is_angle(info().active_joint) ? wrap_angle(gap) : gap);
  }
};

TEST_P(Invariance, OfTheClosureAtAnyReading) {
  for_every_state_and_element([this](State state, const Element& element) {
    state.reading += 0.2;
    EXPECT_NEAR(closure(image(element, state)), closure(state), 1e-12);
  });
}

TEST_P(Invariance, OfTheReachMargin) {
  for_every_state_and_element([this](const State& state, const Element& element) {
    const double expected = margin(state);
    EXPECT_TRUE(std::isinf(expected) || std::abs(margin(image(element, state)) - expected) < 1e-12);
  });
}

TEST_P(Invariance, OfTheReadingInTheImageOfTheWorkingMode) {
  for_every_state_and_element([this](const State& state, const Element& element) {
    const State moved = image(element, state);
    EXPECT_LT(between_readings(moved, reading(moved, moved.mode), moved.reading), 1e-11);
  });
}

TEST_P(Invariance, OfTheDrawing) {
  for_every_state_and_element([this](const State& state, const Element& element) {
    const RowMatrix expected = joint_centres(state) * element.linear().transpose();
    EXPECT_LT((joint_centres(image(element, state)) - expected).cwiseAbs().maxCoeff(), 1e-12);
  });
}

using Orientation = Invariance;

TEST_P(Orientation, OfALegIsFlippedByAReflectionAndKeptByARotation) {
  for_every_state_and_element([this](const State& state, const Element& element) {
    const State moved = image(element, state);
    EXPECT_GT(between_readings(moved, reading(moved, -moved.mode), moved.reading), 1e-3);
  });
}

INSTANTIATE_TEST_SUITE_P(Chains, Invariance, ::testing::ValuesIn(every_chain()), test_name);
INSTANTIATE_TEST_SUITE_P(Chains, Orientation, ::testing::ValuesIn(chains_where(has_two_roots)),
                         test_name);

}  // namespace
}  // namespace symkin::testing
