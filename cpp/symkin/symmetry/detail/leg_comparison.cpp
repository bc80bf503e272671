// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detail/leg_comparison.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/model/pose_space.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"
#include "symkin/symmetry/detail/leg_features.hpp"

namespace symkin {
namespace {

// At the centre of its frame, where angles mean nothing.
constexpr double kCentral = 1e-9;  // m

Index hand_of(const ChainInfo& chain) {
  return static_cast<Index>(chain.find({End::none, ParameterKind::handedness}));
}

// Keeps the parameter by which two legs differ most, in tolerances.
void note(LegDeviation& worst, std::string_view parameter, double deviation, double in_tolerances) {
  if (in_tolerances > worst.in_tolerances) {
    worst.parameter = parameter;
    worst.deviation = deviation;
    worst.in_tolerances = in_tolerances;
  }
}

LegEnd<double> end_of(const ChainInfo& chain, Leg& leg, End end) {
  return leg_end(chain, end, leg.parameters.data());
}

LegEnd<const double> end_of(const ChainInfo& chain, const Leg& leg, End end) {
  return leg_end(chain, end, leg.parameters.data());
}

// The same end in other coordinates: a point on the other side of the origin.
void turn_point_round(const ChainInfo& chain, Leg& leg, End which) {
  const LegEnd<double> end = end_of(chain, leg, which);
  *end.azimuth += kPi;
  *end.radius = -*end.radius;
  if (end.polar_angle != nullptr) {
    *end.polar_angle = kPi - *end.polar_angle;
  }
}

// The same point with its polar angle counted the other way from Z.
void tilt_point_over(const ChainInfo& chain, Leg& leg, End which) {
  const LegEnd<double> end = end_of(chain, leg, which);
  *end.polar_angle = -*end.polar_angle;
  *end.azimuth += kPi;
}

// The joint counted the other way.
void turn_sensor_round(const ChainInfo& chain, Leg& leg) {
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    if (is_sensor(chain.parameters[i].role.kind)) {
      leg.parameters[static_cast<Index>(i)] *= -1;
    }
  }
}

// A guide with its normal turned round, and with it its travel and what it calls ahead.
void turn_guide_round(const ChainInfo& chain, Leg& leg, End which) {
  const LegEnd<double> end = end_of(chain, leg, which);
  *end.direction += kPi;
  if (end.distance != nullptr) {
    *end.distance = -*end.distance;
  }
  if (end.distance_is_in_offset() || travelled_end(chain.active_joint) == which) {
    turn_sensor_round(chain, leg);
  }
  if (chain.mode_is_orientation) {
    leg.working_mode = -leg.working_mode;
  }
}

// A guide in space by the opposite direction: travel and what is ahead are counted the other way.
void turn_space_guide_round(const ChainInfo& chain, Leg& leg, End which) {
  const LegEnd<double> end = end_of(chain, leg, which);
  *end.guide_elevation += kPi;
  *end.guide_swing = -*end.guide_swing;
  turn_sensor_round(chain, leg);
  leg.working_mode = -leg.working_mode;
}

// An axis in space by the opposite direction. Of a crank the angle and the elbow are counted the
// other way, and the zero of the angle stays; of a joint that is not read nothing else changes.
void turn_axis_round(const ChainInfo& chain, Leg& leg, End which) {
  const LegEnd<double> end = end_of(chain, leg, which);
  *end.axis_elevation += kPi;
  *end.axis_swing = -*end.axis_swing;
  if (chain.active_joint == ActiveJoint::angle_about_axis) {
    turn_sensor_round(chain, leg);
    leg.working_mode = -leg.working_mode;
  }
}

struct Point {
  Eigen::Vector3d position;
  double radius, horizontal_radius;
};

Point point_of(const LegEnd<const double>& end) {
  const double polar = end.polar_angle != nullptr ? *end.polar_angle : kPi / 2;
  const double horizontal = *end.radius * std::sin(polar);
  const double height = end.height != nullptr        ? *end.height
                        : end.polar_angle != nullptr ? *end.radius * std::cos(polar)
                                                     : 0;
  return {{horizontal * std::cos(*end.azimuth), horizontal * std::sin(*end.azimuth), height},
          std::abs(*end.radius),
          std::abs(horizontal)};
}

// How far apart two representations of one end are, to choose the nearest: m and rad alike.
double apart(const LegEnd<const double>& a, const LegEnd<const double>& b) {
  double sum = 0;
  for (const auto& [x, y] :
       {std::pair(a.azimuth, b.azimuth), std::pair(a.direction, b.direction),
        std::pair(a.polar_angle, b.polar_angle), std::pair(a.guide_elevation, b.guide_elevation),
        std::pair(a.guide_swing, b.guide_swing), std::pair(a.axis_elevation, b.axis_elevation),
        std::pair(a.axis_swing, b.axis_swing)}) {
    sum += x != nullptr ? std::abs(wrap_angle(*x - *y)) : 0;
  }
  for (const auto& [x, y] : {std::pair(a.radius, b.radius), std::pair(a.distance, b.distance),
                             std::pair(a.height, b.height)}) {
    sum += x != nullptr ? std::abs(*x - *y) : 0;
  }
  return sum;
}

// The leg in the coordinates that are nearest to those of the other.
Leg written_like(const Leg& leg, const Leg& other, const ChainInfo& chain) {
  Leg nearest = leg;
  for (const End which : kEnds) {
    if (is_declared(chain)) {
      const Eigen::Matrix3d frame = declared_frame(chain, leg, which);
      for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
        const auto [end, kind] = chain.parameters[i].role;
        if (end == which && is_of_frame(kind)) {
          nearest.parameters[static_cast<Index>(i)] = other.parameters[static_cast<Index>(i)];
        }
      }
      set_declared_frame(chain, which, frame, nearest);
      continue;
    }
    const LegEnd<const double> wanted = end_of(chain, other, which);
    Leg candidate = nearest;
    // Every way to write it, one after the other.
    const auto consider = [&](auto rewrite) {
      rewrite(chain, candidate, which);
      if (apart(end_of(chain, std::as_const(candidate), which), wanted) <
          apart(end_of(chain, std::as_const(nearest), which), wanted)) {
        nearest = candidate;
      }
    };
    if (wanted.has_point()) {
      consider(turn_point_round);
      if (wanted.polar_angle != nullptr) {
        consider(tilt_point_over);
        consider(turn_point_round);
      }
    }
    candidate = nearest;
    if (wanted.direction != nullptr) {
      consider(turn_guide_round);
    }
    candidate = nearest;
    if (wanted.guide_elevation != nullptr) {
      consider(turn_space_guide_round);
    }
    candidate = nearest;
    if (wanted.axis_elevation != nullptr) {
      consider(turn_axis_round);
    }
  }
  return nearest;
}

// Where two points differ, named by the coordinate that moves them apart most.
void compare_points(const ChainInfo& chain, const Leg& image, const Leg& leg, End which,
                    const Vector& differences, double unit, LegDeviation& worst) {
  const auto a = end_of(chain, image, which);
  const auto b = end_of(chain, leg, which);
  const Point there = point_of(a);
  const Point here = point_of(b);
  const double in_tolerances = (there.position - here.position).norm() / unit;
  const double* const first = leg.parameters.data();
  double most = -1;
  const double* coordinate = b.radius;
  for (const auto& [which, way] :
       {std::pair(b.radius, 1.0), std::pair(b.azimuth, here.horizontal_radius),
        std::pair(b.polar_angle, here.radius), std::pair(b.height, 1.0)}) {
    if (which != nullptr && std::abs(differences[which - first]) * way > most) {
      most = std::abs(differences[which - first]) * way;
      coordinate = which;
    }
  }
  note(worst, chain.parameters[static_cast<std::size_t>(coordinate - first)].name,
       differences[coordinate - first], in_tolerances);
}

double unit_of(const ParameterInfo& parameter, const ChainInfo& chain,
               const ComparisonUnits& units) {
  if (parameter.role.kind == ParameterKind::gain) {
    return units.gain;
  }
  return chain.is_angular(parameter) ? units.angle : units.length;
}

double largest_difference(const Leg& image, const Leg& leg, const ChainInfo& chain,
                          const ComparisonUnits& units, bool sensors) {
  const Vector differences = parameter_differences(leg, image, chain);
  double largest = 0;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterInfo& parameter = chain.parameters[i];
    if (is_sensor(parameter.role.kind) == sensors && !is_mode(chain, parameter)) {
      largest = std::max(
          largest, std::abs(differences[static_cast<Index>(i)]) / unit_of(parameter, chain, units));
    }
  }
  return largest;
}

}  // namespace

bool is_mode(const ChainInfo& chain, const ParameterInfo& parameter) {
  return parameter.role.kind == ParameterKind::handedness &&
         chain.mirror_image != MirrorImage::none;
}

bool same_hand(const ChainInfo& chain, const Leg& leg, const Leg& other, int sense) {
  return !is_declared(chain) || chain.mirror_image == MirrorImage::same ||
         sense * leg.parameters[hand_of(chain)] * other.parameters[hand_of(chain)] > 0;
}

ComparisonUnits comparison_units(const Mechanism& mechanism, const SymmetryTolerance& tolerance) {
  double base = 0;
  double platform = 0;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (const End which : kEnds) {
      const LegEnd<const double> end =
          end_of(mechanism.model(leg).info(), mechanism.leg(leg), which);
      double& farthest = which == End::base ? base : platform;
      // Two angles of a point in space.
      const double turns = end.polar_angle != nullptr ? std::sqrt(2) : 1;
      for (const double* const distance : {end.radius, end.distance}) {
        farthest = std::max(farthest, distance != nullptr ? turns * std::abs(*distance) : 0);
      }
    }
  }
  return {tolerance.length, tolerance.angle, tolerance.gain,
          std::hypot(tolerance.length, base * tolerance.angle),
          std::hypot(tolerance.length, platform * tolerance.angle)};
}

Vector parameter_differences(const Leg& written, const Leg& other, const ChainInfo& chain) {
  const Leg leg = written_like(written, other, chain);
  Vector differences = leg.parameters - other.parameters;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    if (chain.is_angular(chain.parameters[i])) {
      double& difference = differences[static_cast<Index>(i)];
      difference = wrap_angle(difference);
    }
  }
  if (is_declared(chain) && chain.mirror_image == MirrorImage::same) {
    differences[hand_of(chain)] = 0;
  }
  for (const End which : kEnds) {
    const auto a = end_of(chain, leg, which);
    const auto b = end_of(chain, other, which);
    if (!a.has_point()) {
      continue;
    }
    if (std::max(point_of(a).horizontal_radius, point_of(b).horizontal_radius) < kCentral) {
      differences[a.azimuth - leg.parameters.data()] = 0;
    }
    if (a.polar_angle != nullptr && std::max(point_of(a).radius, point_of(b).radius) < kCentral) {
      differences[a.polar_angle - leg.parameters.data()] = 0;
    }
  }
  return differences;
}

Leg with_guides_outward(const Leg& leg, const ChainInfo& chain) {
  Leg result = leg;
  for (const End which : kEnds) {
    const LegEnd<const double> end = end_of(chain, leg, which);
    if (end.distance != nullptr && *end.distance < 0) {
      turn_guide_round(chain, result, which);
    }
  }
  return result;
}

LegDeviation compare_structure(const Leg& image, const Leg& leg, const ChainInfo& chain,
                               const ComparisonUnits& units) {
  LegDeviation worst;
  const Leg rewritten = written_like(image, leg, chain);
  const Vector differences = parameter_differences(leg, rewritten, chain);
  const double* const first = leg.parameters.data();
  std::vector<bool> done(chain.parameters.size(), false);
  for (const End which : kEnds) {
    const auto end = end_of(chain, leg, which);
    const double unit = which == End::base ? units.base : units.platform;
    if (end.has_point()) {
      compare_points(chain, rewritten, leg, which, differences, unit, worst);
      for (const double* const coordinate :
           {end.radius, end.azimuth, end.polar_angle, end.height}) {
        if (coordinate != nullptr) {
          done[static_cast<std::size_t>(coordinate - first)] = true;
        }
      }
    }
    if (end.distance != nullptr) {
      const auto i = end.distance - first;
      note(worst, chain.parameters[static_cast<std::size_t>(i)].name, differences[i],
           std::abs(differences[i]) / unit);
      done[static_cast<std::size_t>(i)] = true;
    }
  }
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterInfo& parameter = chain.parameters[i];
    if (!done[i] && !is_sensor(parameter.role.kind) && !is_mode(chain, parameter)) {
      const double deviation = differences[static_cast<Index>(i)];
      note(worst, parameter.name, deviation,
           std::abs(deviation) / unit_of(parameter, chain, units));
    }
  }
  worst.same_mode =
      rewritten.working_mode == leg.working_mode && same_hand(chain, rewritten, leg, 1);
  return worst;
}

double structure_apart(const Leg& image, const Leg& leg, const ChainInfo& chain,
                       const ComparisonUnits& units) {
  return largest_difference(image, leg, chain, units, false);
}

double sensors_apart(const Leg& image, const Leg& leg, const ChainInfo& chain,
                     const ComparisonUnits& units) {
  return largest_difference(image, leg, chain, units, true);
}

}  // namespace symkin
