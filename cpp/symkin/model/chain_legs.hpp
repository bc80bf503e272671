// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "symkin/model/batched_leg.hpp"

namespace symkin::detail {

// Legs of one chain as Newton's method takes them (see Newton), several poses side by side.
template <typename Leg, typename Sensor, typename T>
class ChainLegs {
  using Sensed = SensedLeg<Leg, Sensor>;
  using Batched = BatchedLeg<Leg, Sensor, T>;
  using Coordinates = typename Batched::Coordinates;
  using Rows = LaneRows<T>;
  using L = Lanes<T>;
  using Mask = typename L::Mask;
  using Joint = decltype(Sensed::joint(std::declval<T>()));

  // A leg, its active joint as read, and as it would stand at the start pose.
  struct LegState {
    typename Batched::Values values;
    Joint joint, joint_at_start;
    Mask side;  // of its singularities (type 1) at the start: dh/dq > 0
  };

 public:
  using Source = LegSpan;
  using Scalar = T;
  using Pose = typename Leg::template Pose<T>;
  static constexpr std::size_t kClosures = Sensed::kClosures;

  explicit ChainLegs(LegSpan legs)
      : legs_(legs, [](const LegValues& leg) {
          return LegState{Batched::values(leg), {}, {}, {}};
        }) {}

  std::size_t size() const { return legs_.size(); }

  // Reads the joints. On which side of the singularities the start pose lies, the mechanism's own
  // joints there say; where a leg cannot reach it, those to be solved, which are close to them.
  void set_out(const Rows& rows, const double* readings, const Coordinates& start, bool sides) {
    const Pose pose = Pose::constant(start.data());
    const auto count = static_cast<Index>(legs_.size());
    for (LegState& leg : legs_) {
      leg.joint = Sensed::joint(leg.values.sensor.active_joint(rows.read(readings++, count)));
      leg.joint_at_start =
          or_else(Leg::root(leg.values.geometry, pose, leg.values.mode), leg.joint);
      if (sides) {
        leg.side = slope(leg, pose, leg.joint_at_start) > T(0.0);
      }
    }
  }

  auto variable(const Coordinates& coordinates) const {
    return Leg::template Pose<Jet<T, Pose::kDof>>::variable(coordinates.data(), 0);
  }

  template <typename VariablePose>
  auto closures(std::size_t leg, const VariablePose& pose, bool at_start) const {
    const LegState& state = legs_[leg];
    return Sensed::template closures<T>(state.values.geometry, pose,
                                        at_start ? state.joint_at_start : state.joint);
  }

  Mask same_sides(const Coordinates& coordinates) const {
    const Pose pose = Pose::constant(coordinates.data());
    Mask same = coordinates[0] == coordinates[0];  // NOLINT(misc-redundant-expression)
    for (const LegState& leg : legs_) {
      same = same && (slope(leg, pose, leg.joint) > T(0.0)) == leg.side;
    }
    return same;
  }

  // A solution counts only if every leg stands in its working mode there: its joint is the root
  // that the mode picks, up to the square root of the rounding at the end of its reach.
  Mask in_working_modes(const Coordinates& coordinates) const {
    const T tolerance(1e-6);
    const Pose pose = Pose::constant(coordinates.data());
    Mask all = coordinates[0] == coordinates[0];  // NOLINT(misc-redundant-expression)
    for (const LegState& leg : legs_) {
      // A root that is not a number, just beyond the reach, fails the comparison too.
      all = all &&
            distance(Leg::root(leg.values.geometry, pose, leg.values.mode), leg.joint) < tolerance;
    }
    return all;
  }

 private:
  // The joint, where it is not a number the other.
  static Joint or_else(const Joint& joint, const Joint& other) {
    if constexpr (Sensed::kAngular) {
      const Mask good = joint.sine == joint.sine;
      return {L::select(good, joint.cosine, other.cosine), L::select(good, joint.sine, other.sine)};
    } else {
      return L::select(joint == joint, joint, other);  // NOLINT(misc-redundant-expression)
    }
  }

  // dh/dq, of the first closure
  static T slope(const LegState& leg, const Pose& pose, const Joint& joint) {
    using D = Jet<T, 1>;
    const auto closure = [&](const auto& q) {
      return Sensed::template closures<T>(leg.values.geometry, pose, q).front().v[0];
    };
    if constexpr (Sensed::kAngular) {
      return closure(Azimuth<D>(jet_of<T, 1>(joint.cosine, [&](int) { return -joint.sine; }),
                                jet_of<T, 1>(joint.sine, [&](int) { return joint.cosine; })));
    } else {
      return closure(D(joint, 0));
    }
  }

  // Of joints that are close to each other.
  static T distance(const Joint& joint, const Joint& other) {
    using std::abs;
    if constexpr (Sensed::kAngular) {
      return abs(joint.cosine - other.cosine) + abs(joint.sine - other.sine);
    } else {
      return abs(joint - other);
    }
  }

  PerLeg<LegState> legs_;
};

}  // namespace symkin::detail
