// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "symkin/model/chain_info.hpp"

namespace symkin {

inline constexpr std::array<End, 2> kEnds{End::base, End::platform};

// One end of a leg within its parameters; null where the chain has none. T is double or const
// double.
template <typename T>
struct LegEnd {
  T* radius;  // of a point
  T* azimuth;
  T* polar_angle;
  T* height;
  T* direction;        // azimuth of a guide's normal
  T* distance;         // of a guide from the origin
  T* guide_elevation;  // of a guide in space
  T* guide_swing;
  T* axis_elevation;  // of an axis in space
  T* axis_swing;

  bool has_point() const { return radius != nullptr && azimuth != nullptr; }
  // A guide that is known by its direction alone is read from the frame's origin.
  bool distance_is_in_offset() const {
    return direction != nullptr && distance == nullptr && !has_point();
  }
};

// The place of a role within the parameters; null where the chain has none.
template <typename T>
T* find_parameter(const ChainInfo& chain, ParameterRole role, T* parameters) {
  const std::size_t place = chain.find(role);
  return place < chain.parameters.size() ? parameters + place : nullptr;
}

template <typename T>
LegEnd<T> leg_end(const ChainInfo& chain, End end, T* parameters) {
  const auto find = [&](ParameterKind kind) {
    return find_parameter(chain, {end, kind}, parameters);
  };
  return {find(ParameterKind::radius),
          find(ParameterKind::azimuth),
          find(ParameterKind::polar_angle),
          find(ParameterKind::height),
          find(ParameterKind::direction_azimuth),
          find(ParameterKind::direction_distance),
          find(ParameterKind::guide_elevation),
          find(ParameterKind::guide_swing),
          find(ParameterKind::axis_elevation),
          find(ParameterKind::axis_swing)};
}

}  // namespace symkin
