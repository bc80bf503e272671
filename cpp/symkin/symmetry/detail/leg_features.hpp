// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "symkin/model/mechanism.hpp"

namespace symkin {

// A line that may be given by either direction; by its direction alone if no place is known of it.
struct LineFeature {
  Eigen::Vector3d direction;  // unit
  Eigen::Vector3d through;
  bool placed = false;
};

// What of a leg's end an isometry of its space has to carry, in that space's frame.
struct EndFeatures {
  std::optional<Eigen::Vector3d> point;
  std::vector<LineFeature> lines;         // first a guide, if there is one
  std::vector<Eigen::Vector3d> directed;  // whose sense counts
};

// Both ends of a leg: base, platform. A platform that does not turn has none.
using LegFeatures = std::array<EndFeatures, 2>;

LegFeatures features_of(const ChainInfo& chain, const Leg& leg);

// Whether the leg is declared joint by joint: its ends are whole frames.
bool is_declared(const ChainInfo& chain);

// The frame that a declared end begins with, and the leg with another one there: by its turns
// nearest to those that it has, behind the same azimuth unless there is nothing but that.
Eigen::Matrix3d declared_frame(const ChainInfo& chain, const Leg& leg, End end);
void set_declared_frame(const ChainInfo& chain, End end, const Eigen::Matrix3d& frame, Leg& leg);

// Whether a parameter is one of that frame.
constexpr bool is_of_frame(ParameterKind kind) { return turns(kind) || turns_frame(kind); }

// Counted so that it is nearest to another.
inline double counted_like(double angle, double other) { return other + wrap_angle(angle - other); }

// An axis about which an angle is counted, and the two directions that make a right-handed frame
// with it: from the first the angle is counted, towards the second.
struct AngleFrame {
  Eigen::Vector3d axis, zero, ahead;
};
AngleFrame crank_frame(const ChainInfo& chain, const Leg& leg);
AngleFrame meridian_frame(const ChainInfo& chain, const Leg& leg, End end);

}  // namespace symkin
