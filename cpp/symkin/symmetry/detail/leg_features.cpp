// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detail/leg_features.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "symkin/model/pose_space.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"

namespace symkin {
namespace {

using Eigen::Vector3d;

Vector3d radial(double azimuth) { return {std::cos(azimuth), std::sin(azimuth), 0}; }
Vector3d tangential(double azimuth) { return {-std::sin(azimuth), std::cos(azimuth), 0}; }

// Of a direction in space, given from an azimuth of its own: guides from the radial direction,
// axes from the tangential one (see docs/chains.md).
Vector3d guide_direction(double azimuth, double elevation, double swing) {
  return std::cos(swing) *
             (std::cos(elevation) * radial(azimuth) + std::sin(elevation) * Vector3d::UnitZ()) +
         std::sin(swing) * tangential(azimuth);
}

Vector3d axis_direction(double azimuth, double elevation, double swing) {
  return std::cos(swing) *
             (std::cos(elevation) * tangential(azimuth) + std::sin(elevation) * Vector3d::UnitZ()) +
         std::sin(swing) * radial(azimuth);
}

double azimuth_of(const ChainInfo& chain, const Leg& leg, End end, ParameterKind kind) {
  return *find_parameter(chain, {end, kind}, leg.parameters.data());
}

Vector3d place_of_point(const LegEnd<const double>& end) {
  const double polar = end.polar_angle != nullptr ? *end.polar_angle : kPi / 2;
  const double height = end.height != nullptr ? *end.height : *end.radius * std::cos(polar);
  return *end.radius * std::sin(polar) * radial(*end.azimuth) +
         (end.height != nullptr || end.polar_angle != nullptr ? height : 0) * Vector3d::UnitZ();
}

// The frame that a declared end begins with; all behind it is the leg's own. Y a mirror turns
// round.
EndFeatures declared_end(const ChainInfo& chain, const Leg& leg, End which) {
  const Eigen::Matrix3d frame = declared_frame(chain, leg, which);
  return {Vector3d::Zero(), {}, {frame.col(0), frame.col(2)}};
}

EndFeatures planar_end(const LegEnd<const double>& end, const ChainInfo& chain, const Leg& leg) {
  EndFeatures features;
  if (end.direction != nullptr && (end.has_point() || end.distance != nullptr)) {
    const Vector3d through =
        end.has_point() ? place_of_point(end) : *end.distance * radial(*end.direction);
    features.lines.push_back({tangential(*end.direction), through, true});
  } else if (end.has_point()) {
    features.point = place_of_point(end);
  } else if (end.direction != nullptr) {
    // Its place is in the offset: known, but no part of the structure.
    const double offset =
        *find_parameter(chain, {End::none, ParameterKind::offset}, leg.parameters.data());
    features.lines.push_back({radial(*end.direction), offset * radial(*end.direction), false});
  }
  return features;
}

EndFeatures spatial_end(const LegEnd<const double>& end, const ChainInfo& chain, const Leg& leg,
                        End which) {
  EndFeatures features;
  if (end.guide_elevation != nullptr) {
    // Where the point is along the guide is the sensor's zero.
    features.lines.push_back(
        {guide_direction(azimuth_of(chain, leg, which, ParameterKind::guide_azimuth),
                         *end.guide_elevation, *end.guide_swing),
         place_of_point(end), true});
  } else if (end.has_point()) {
    features.point = place_of_point(end);
  }
  if (end.axis_elevation != nullptr) {
    features.lines.push_back(
        {axis_direction(azimuth_of(chain, leg, which, ParameterKind::axis_azimuth),
                        *end.axis_elevation, *end.axis_swing),
         Vector3d::Zero(), false});
  }
  // A cable comes up the vertical axis of its pulley.
  if (which == End::base &&
      chain.find({End::none, ParameterKind::pulley_radius}) < chain.parameters.size()) {
    features.directed.push_back(Vector3d::UnitZ());
  }
  return features;
}

}  // namespace

bool is_declared(const ChainInfo& chain) {
  return chain.find({End::none, ParameterKind::handedness}) < chain.parameters.size();
}

Eigen::Matrix3d declared_frame(const ChainInfo& chain, const Leg& leg, End which) {
  const auto angle = [&](ParameterKind kind) {
    const double* const found = find_parameter(chain, {which, kind}, leg.parameters.data());
    return found != nullptr ? *found : 0;
  };
  using Eigen::AngleAxisd;
  return (AngleAxisd(angle(ParameterKind::axis_azimuth) + angle(ParameterKind::frame_yaw),
                     Vector3d::UnitZ()) *
          AngleAxisd(angle(ParameterKind::frame_pitch), Vector3d::UnitY()) *
          AngleAxisd(angle(ParameterKind::frame_roll), Vector3d::UnitX()))
      .toRotationMatrix();
}

void set_declared_frame(const ChainInfo& chain, End which, const Eigen::Matrix3d& frame, Leg& leg) {
  constexpr double kUpright = 1e-9;
  double* const parameters = leg.parameters.data();
  double* const azimuth = find_parameter(chain, {which, ParameterKind::axis_azimuth}, parameters);
  double* const roll = find_parameter(chain, {which, ParameterKind::frame_roll}, parameters);
  if (roll == nullptr) {  // turned about Z alone
    if (azimuth != nullptr) {
      *azimuth = counted_like(std::atan2(frame(1, 0), frame(0, 0)), *azimuth);
    }
    return;
  }
  double& pitch = *find_parameter(chain, {which, ParameterKind::frame_pitch}, parameters);
  double& yaw = *find_parameter(chain, {which, ParameterKind::frame_yaw}, parameters);
  const double first = azimuth != nullptr ? *azimuth : 0;
  const double level = std::hypot(frame(0, 0), frame(1, 0));
  double turn = first + yaw;
  if (level > kUpright) {
    // Of the two ways to write it, the one on whose side the pitch is.
    const double side = std::cos(pitch) < -kUpright ? -1 : 1;
    turn = std::atan2(side * frame(1, 0), side * frame(0, 0));
    pitch = counted_like(std::atan2(-frame(2, 0), side * level), pitch);
  } else {  // only roll and yaw together mean something
    pitch = counted_like(std::copysign(kPi / 2, -frame(2, 0)), pitch);
  }
  const Vector3d across = tangential(turn);
  *roll = counted_like(std::atan2(-across.dot(frame.col(2)), across.dot(frame.col(1))), *roll);
  yaw = counted_like(turn - first, yaw);
}

LegFeatures features_of(const ChainInfo& chain, const Leg& leg) {
  LegFeatures features;
  for (const End which : kEnds) {
    if (which == End::platform && !has_orientation(chain.pose_space)) {
      if (is_declared(chain)) {  // a platform that does not turn goes with the base
        for (const Vector3d& axis : declared_end(chain, leg, which).directed) {
          features[0].directed.push_back(axis);
        }
      }
      break;
    }
    EndFeatures& own = features[which == End::base ? 0 : 1];
    const auto end = leg_end(chain, which, leg.parameters.data());
    if (is_declared(chain)) {
      own = declared_end(chain, leg, which);
    } else if (chain.pose_space == PoseSpace::spherical) {
      own.lines.push_back({meridian_frame(chain, leg, which).axis, Vector3d::Zero(), false});
    } else if (position_size(chain.pose_space) == 2) {
      own = planar_end(end, chain, leg);
    } else {
      own = spatial_end(end, chain, leg, which);
    }
    if (position_size(chain.pose_space) == 2) {
      own.directed.push_back(Vector3d::UnitZ());  // nothing leaves the plane
    }
  }
  return features;
}

AngleFrame crank_frame(const ChainInfo& chain, const Leg& leg) {
  const auto end = leg_end(chain, End::base, leg.parameters.data());
  const double azimuth = azimuth_of(chain, leg, End::base, ParameterKind::axis_azimuth);
  const Vector3d axis = axis_direction(azimuth, *end.axis_elevation, *end.axis_swing);
  // d axis / d swing.
  const Vector3d zero = axis_direction(azimuth, *end.axis_elevation, *end.axis_swing + kPi / 2);
  return {axis, zero, axis.cross(zero)};
}

AngleFrame meridian_frame(const ChainInfo& chain, const Leg& leg, End which) {
  const auto [polar, azimuth] =
      std::pair(*find_parameter(chain, {which, ParameterKind::polar_angle}, leg.parameters.data()),
                *find_parameter(chain, {which, ParameterKind::azimuth}, leg.parameters.data()));
  const Vector3d axis = std::sin(polar) * radial(azimuth) + std::cos(polar) * Vector3d::UnitZ();
  const Vector3d zero = std::cos(polar) * radial(azimuth) - std::sin(polar) * Vector3d::UnitZ();
  return {axis, zero, tangential(azimuth)};
}

}  // namespace symkin
