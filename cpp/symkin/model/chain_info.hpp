// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>
#include <vector>

#include "symkin/model/pose.hpp"

namespace symkin {

// What a parameter is, hence its unit and how a symmetry acts on it.
enum class ParameterRole {
  length,            // m; unchanged by every symmetry
  base_azimuth,      // rad, about Z of the base frame; turns with the base
  platform_azimuth,  // rad, about the platform's normal; turns with the platform
  polar_angle,       // rad, from the Z axis; unchanged
  gain,              // active joint variable per sensor reading; unchanged
  offset,            // active joint variable at zero reading; see ActiveJoint
};

struct ParameterInfo {
  std::string_view name;
  ParameterRole role;
};

// What the active joint variable q measures, hence its unit and how a symmetry acts on it.
enum class ActiveJoint {
  angle_in_base,       // rad, direction of a link in the base frame
  angle_in_platform,   // rad, direction of a link in the platform frame
  elbow_angle,         // rad, between two links
  travel_on_base,      // m, signed, along a guide on the base, from its foot
  travel_on_platform,  // m, signed, along a guide on the platform, from its foot
  distance,            // m, to a point or a line
};

constexpr bool is_angle(ActiveJoint joint) {
  return joint == ActiveJoint::angle_in_base || joint == ActiveJoint::angle_in_platform ||
         joint == ActiveJoint::elbow_angle;
}

// How the base (or the platform) places its end of the leg.
enum class Anchor {
  point,      // polar coordinates of a point
  line,       // Hesse form of a guide line
  direction,  // direction of a guide alone; its distance is part of the sensor offset
};

struct ChainInfo {
  std::string_view name;
  PoseSpace pose_space;
  std::vector<ParameterInfo> parameters;  // the sensor's gain and offset are the last two
  ActiveJoint active_joint;
  Anchor base_anchor;
  Anchor platform_anchor;
  bool mode_is_orientation;       // a reflection flips the working mode
  std::string_view working_mode;  // what the sign of the working mode means
};

// The names that chains share.
namespace parameter {
inline constexpr ParameterInfo kProximalLength{"proximal_length", ParameterRole::length};
inline constexpr ParameterInfo kDistalLength{"distal_length", ParameterRole::length};
inline constexpr ParameterInfo kGuideOffset{"guide_offset", ParameterRole::length};
inline constexpr ParameterInfo kBaseRadius{"base_radius", ParameterRole::length};
inline constexpr ParameterInfo kBaseAngle{"base_angle", ParameterRole::base_azimuth};
inline constexpr ParameterInfo kBasePolarAngle{"base_polar_angle", ParameterRole::polar_angle};
inline constexpr ParameterInfo kBaseAzimuth{"base_azimuth", ParameterRole::base_azimuth};
inline constexpr ParameterInfo kPlatformRadius{"platform_radius", ParameterRole::length};
inline constexpr ParameterInfo kPlatformAngle{"platform_angle", ParameterRole::platform_azimuth};
inline constexpr ParameterInfo kPlatformPolarAngle{"platform_polar_angle",
                                                   ParameterRole::polar_angle};
inline constexpr ParameterInfo kPlatformAzimuth{"platform_azimuth",
                                                ParameterRole::platform_azimuth};
inline constexpr ParameterInfo kSensorGain{"sensor_gain", ParameterRole::gain};
inline constexpr ParameterInfo kSensorOffset{"sensor_offset", ParameterRole::offset};
}  // namespace parameter

}  // namespace symkin
