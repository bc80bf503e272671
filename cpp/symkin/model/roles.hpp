// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace symkin {

// What a row of a pose array means. Errors, noise and derivatives live in the tangent: position
// first, then the orientation (an angle, or a rotation vector in the base frame).
//   planar       x, y, phi                  3 coordinates, 3 degrees of freedom
//   point        x, y                       2 coordinates, 2 degrees of freedom
//   spatial      x, y, z, qx, qy, qz, qw    7 coordinates, 6 degrees of freedom (unit quaternion)
//   translating  x, y, z                    3 coordinates, 3 degrees of freedom
//   spherical    qx, qy, qz, qw             4 coordinates, 3 degrees of freedom (unit quaternion)
//   schoenflies  x, y, z, theta             4 coordinates, 4 degrees of freedom
enum class PoseSpace { planar, point, spatial, translating, spherical, schoenflies };

// The platform that the legs carry: one that turns, a point that only moves in the plane
// (five-bar), one in space that never turns (delta), one that turns about a fixed point (Agile
// Eye), or one in space that turns about Z alone (H4).
enum class Platform { rigid, point, translating, spherical, schoenflies };

// The end of a leg that a parameter belongs to, whose frame it is given in and with which it turns.
enum class End {
  none,  // the links and the sensor
  base,
  platform,
};

// What a parameter is. An end may have a point, a direction, or both: a guide is a line by its
// direction and its distance from the origin, or by its direction and a point of it; by its
// direction alone its distance is part of the sensor's offset. A direction in space, of a guide or
// of the axis that a crank turns about, is given by two small angles from an azimuth of its own.
enum class ParameterKind {
  length,                 // m, of a link: positive
  arc,                    // rad, of a link on a sphere: between 0 and pi
  eccentricity,           // m, of a guide from the joint that it turns about; of either sign
  pulley_radius,          // m, that a cable runs over: given, and estimated only if it is asked for
  radius,                 // m, of a point from the origin
  azimuth,                // rad, of a point or an axis about Z
  polar_angle,            // rad, of a point or an axis from Z
  height,                 // m, of a point along Z
  direction_azimuth,      // rad, about Z, of the normal of a guide in the plane
  direction_distance,     // m, of a guide from the origin along its normal; of either sign
  guide_azimuth,          // rad, about Z, that a guide in space is given from; never estimated
  guide_elevation,        // rad, of a guide from its azimuth towards Z
  guide_swing,            // rad, of a guide out of the plane of its elevation
  axis_azimuth,           // rad, about Z, that an axis in space is given from; never estimated
  axis_elevation,         // rad, of an axis from the tangent at its azimuth towards Z
  axis_swing,             // rad, of an axis out of the plane of its elevation
  coordinate,             // m, of a declared transform, along x or z; of either sign
  mirrored_coordinate,    // m, the same along y
  small_turn,             // rad, the same about y, beside how it is drawn
  mirrored_small_turn,    // rad, the same about x or z
  written_turn,           // rad, about y, as it is drawn; never estimated
  mirrored_written_turn,  // rad, the same about x or z
  frame_roll,             // rad, about x, of the frame that a declared end begins with, turned by
  frame_pitch,            // rad, about y, its azimuth first; then by yaw, pitch and roll, as it is
  frame_yaw,              // rad, about z, drawn; never estimated
  handedness,             // -1 of a declared leg whose joints stand at home in a mirror, else 1
  gain,                   // active joint variable per sensor reading
  offset,                 // active joint variable at zero reading; see ActiveJoint
  curvature,              // of a sensor, beside its gain and offset
  absent,                 // none of this leg's: legs of another chain have one of that name
};

struct ParameterRole {
  End end;
  ParameterKind kind;

  friend constexpr bool operator==(ParameterRole a, ParameterRole b) {
    return a.end == b.end && a.kind == b.kind;
  }
};

// Of a declared end, how the frame that it begins with is drawn, behind the azimuth.
constexpr bool turns_frame(ParameterKind kind) {
  return kind == ParameterKind::frame_roll || kind == ParameterKind::frame_pitch ||
         kind == ParameterKind::frame_yaw;
}

// Part of the description, or of no description, not of what is known with an error.
constexpr bool is_constant(ParameterKind kind) {
  return kind == ParameterKind::guide_azimuth || kind == ParameterKind::axis_azimuth ||
         kind == ParameterKind::written_turn || kind == ParameterKind::mirrored_written_turn ||
         turns_frame(kind) || kind == ParameterKind::handedness || kind == ParameterKind::absent;
}

// A rotation about Z by a adds a to it, a reflection about the line at a makes it 2 a less itself.
constexpr bool turns(ParameterKind kind) {
  return kind == ParameterKind::azimuth || kind == ParameterKind::direction_azimuth ||
         kind == ParameterKind::guide_azimuth || kind == ParameterKind::axis_azimuth;
}

// A reflection changes its sign, a rotation leaves it. An axis has a sense of turning, which a
// reflection reverses: it is an axial vector, a guide a polar one. A declared leg is mirrored in
// the plane of x and z of each of its frames.
constexpr bool is_mirrored(ParameterKind kind) {
  return kind == ParameterKind::axis_elevation || kind == ParameterKind::axis_swing ||
         kind == ParameterKind::guide_swing || kind == ParameterKind::mirrored_coordinate ||
         kind == ParameterKind::mirrored_small_turn ||
         kind == ParameterKind::mirrored_written_turn || kind == ParameterKind::frame_roll ||
         kind == ParameterKind::frame_yaw || kind == ParameterKind::handedness;
}

// Taken as it is given, unless somebody frees it.
constexpr bool is_given(ParameterKind kind) { return kind == ParameterKind::pulley_radius; }

// An angle of the geometry. Whether an offset is one, the active joint says.
constexpr bool is_angle(ParameterKind kind) {
  return turns(kind) || kind == ParameterKind::axis_elevation ||
         kind == ParameterKind::axis_swing || kind == ParameterKind::guide_swing ||
         kind == ParameterKind::polar_angle || kind == ParameterKind::guide_elevation ||
         kind == ParameterKind::arc || kind == ParameterKind::small_turn ||
         kind == ParameterKind::mirrored_small_turn || kind == ParameterKind::written_turn ||
         kind == ParameterKind::mirrored_written_turn || turns_frame(kind);
}

constexpr bool is_sensor(ParameterKind kind) {
  return kind == ParameterKind::gain || kind == ParameterKind::offset ||
         kind == ParameterKind::curvature;
}

struct ParameterInfo {
  std::string_view name;
  ParameterRole role;
  bool held = false;  // of a declared leg: exact, or shown by nothing that others do not show
};

// What the active joint variable q measures, hence its unit and how a symmetry acts on it.
enum class ActiveJoint {
  angle_in_base,          // rad, direction of a link in the base frame
  angle_in_platform,      // rad, direction of a link in the platform frame
  elbow_angle,            // rad, between two links
  travel_on_base,         // m, signed, along a guide on the base, from its foot
  travel_on_platform,     // m, signed, along a guide on the platform, from its foot
  distance,               // m, to a point or a line
  travel_from_point,      // m, signed, along a guide in space, from a point of it
  angle_about_axis,       // rad, of a crank about an axis in space, from a direction that it brings
  angle_from_meridian,    // rad, of a link about an axis through the centre, from the meridian
  joint_turn,             // rad, of a declared joint about y of its frame
  mirrored_joint_turn,    // rad, the same about x or z
  joint_travel,           // m, of a declared joint along x or z of its frame
  mirrored_joint_travel,  // m, the same along y
};

constexpr bool is_angle(ActiveJoint joint) {
  return joint == ActiveJoint::angle_in_base || joint == ActiveJoint::angle_in_platform ||
         joint == ActiveJoint::elbow_angle || joint == ActiveJoint::angle_about_axis ||
         joint == ActiveJoint::angle_from_meridian || joint == ActiveJoint::joint_turn ||
         joint == ActiveJoint::mirrored_joint_turn;
}

// A reflection changes the sign of the reading.
constexpr bool is_mirrored(ActiveJoint joint) {
  return joint != ActiveJoint::distance && joint != ActiveJoint::travel_from_point &&
         joint != ActiveJoint::angle_about_axis && joint != ActiveJoint::joint_turn &&
         joint != ActiveJoint::joint_travel;
}

// The end whose guide in the plane q is the travel on.
constexpr End travelled_end(ActiveJoint joint) {
  return joint == ActiveJoint::travel_on_base       ? End::base
         : joint == ActiveJoint::travel_on_platform ? End::platform
                                                    : End::none;
}

// The end in whose frame q is the direction of a link.
constexpr End turned_end(ActiveJoint joint) {
  return joint == ActiveJoint::angle_in_base       ? End::base
         : joint == ActiveJoint::angle_in_platform ? End::platform
                                                   : End::none;
}

}  // namespace symkin
