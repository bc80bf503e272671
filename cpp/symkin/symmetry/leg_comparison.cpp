// SPDX-License-Identifier: MIT
#include "symkin/symmetry/leg_comparison.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/leg_ends.hpp"

namespace symkin {
namespace {

// At the centre of its frame, where angles mean nothing.
constexpr double kCentral = 1e-9;  // m

bool is_turning(const ParameterInfo& parameter, const ChainInfo& chain) {
  switch (parameter.role) {
    case ParameterRole::base_azimuth:
    case ParameterRole::platform_azimuth:
    case ParameterRole::polar_angle:
      return true;
    case ParameterRole::offset:
      return is_angle(chain.active_joint);
    default:
      return false;
  }
}

bool is_sensor(const ParameterInfo& parameter) {
  return parameter.role == ParameterRole::gain || parameter.role == ParameterRole::offset;
}

// Keeps the parameter by which two legs differ most, in tolerances.
void note(LegDeviation& worst, std::string_view parameter, double deviation, double in_tolerances) {
  if (in_tolerances > worst.in_tolerances) {
    worst.parameter = parameter;
    worst.deviation = deviation;
    worst.in_tolerances = in_tolerances;
  }
}

LegEnd<double> end_of(const ChainInfo& chain, Leg& leg, bool platform) {
  double* const parameters = leg.parameters.data();
  return platform ? platform_end(chain, parameters) : base_end(chain, parameters);
}

LegEnd<const double> end_of(const ChainInfo& chain, const Leg& leg, bool platform) {
  const double* const parameters = leg.parameters.data();
  return platform ? platform_end(chain, parameters) : base_end(chain, parameters);
}

// The same end in other coordinates: a point on the other side of the origin; a guide with its
// normal turned round, and with it its travel and what it calls ahead.
void turn_round(const ChainInfo& chain, Leg& leg, bool platform) {
  const LegEnd<double> end = end_of(chain, leg, platform);
  const Anchor anchor = platform ? chain.platform_anchor : chain.base_anchor;
  *end.azimuth += kPi;
  if (end.radius != nullptr) {
    *end.radius = -*end.radius;
  }
  if (end.polar_angle != nullptr) {
    *end.polar_angle = kPi - *end.polar_angle;
  }
  if (anchor == Anchor::point) {
    return;
  }
  const ActiveJoint travel =
      platform ? ActiveJoint::travel_on_platform : ActiveJoint::travel_on_base;
  if (anchor == Anchor::direction || chain.active_joint == travel) {
    leg.parameters.tail<2>() *= -1;
  }
  if (chain.mode_is_orientation) {
    leg.working_mode = -leg.working_mode;
  }
}

// The same point with its polar angle counted the other way from Z.
void tilt_over(const ChainInfo& chain, Leg& leg, bool platform) {
  const LegEnd<double> end = end_of(chain, leg, platform);
  *end.polar_angle = -*end.polar_angle;
  *end.azimuth += kPi;
}

struct Point {
  Eigen::Vector3d position;
  double radius, horizontal_radius;
};

Point point_of(const LegEnd<const double>& end) {
  const double polar = end.polar_angle != nullptr ? *end.polar_angle : kPi / 2;
  const double horizontal = *end.radius * std::sin(polar);
  return {{horizontal * std::cos(*end.azimuth), horizontal * std::sin(*end.azimuth),
           end.polar_angle != nullptr ? *end.radius * std::cos(polar) : 0},
          std::abs(*end.radius),
          std::abs(horizontal)};
}

// How far apart two representations of one end are, to choose the nearest: m and rad alike.
double apart(const LegEnd<const double>& a, const LegEnd<const double>& b) {
  double sum = std::abs(wrap_angle(*a.azimuth - *b.azimuth));
  if (a.radius != nullptr) {
    sum += std::abs(*a.radius - *b.radius);
  }
  if (a.polar_angle != nullptr) {
    sum += std::abs(wrap_angle(*a.polar_angle - *b.polar_angle));
  }
  return sum;
}

// The leg in the coordinates that are nearest to those of the other.
Leg written_like(const Leg& leg, const Leg& other, const ChainInfo& chain) {
  Leg nearest = leg;
  for (const bool platform : {false, true}) {
    const LegEnd<const double> wanted = end_of(chain, other, platform);
    if (wanted.azimuth == nullptr) {
      continue;
    }
    Leg candidate = nearest;
    // Every way to write it, one after the other.
    for (int way = 1; way < (wanted.polar_angle != nullptr ? 4 : 2); ++way) {
      if (way == 2) {
        tilt_over(chain, candidate, platform);
      } else {
        turn_round(chain, candidate, platform);
      }
      if (apart(end_of(chain, std::as_const(candidate), platform), wanted) <
          apart(end_of(chain, std::as_const(nearest), platform), wanted)) {
        nearest = candidate;
      }
    }
  }
  return nearest;
}

// Where two points differ, named by the coordinate that moves them apart most.
void compare_points(const ChainInfo& chain, const Leg& image, const Leg& leg, bool platform,
                    const Vector& differences, double unit, LegDeviation& worst) {
  const auto a = end_of(chain, image, platform);
  const auto b = end_of(chain, leg, platform);
  const Point there = point_of(a);
  const Point here = point_of(b);
  const double in_tolerances = (there.position - here.position).norm() / unit;
  const double* const first = leg.parameters.data();
  double most = -1;
  const double* coordinate = b.radius;
  for (const auto& [which, way] :
       {std::pair(b.radius, 1.0), std::pair(b.azimuth, here.horizontal_radius),
        std::pair(b.polar_angle, here.radius)}) {
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
  if (parameter.role == ParameterRole::gain) {
    return units.gain;
  }
  return is_turning(parameter, chain) ? units.angle : units.length;
}

double largest_difference(const Leg& image, const Leg& leg, const ChainInfo& chain,
                          const ComparisonUnits& units, bool sensors) {
  const Vector differences = parameter_differences(leg, image, chain);
  double largest = 0;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterInfo& parameter = chain.parameters[i];
    if (is_sensor(parameter) == sensors) {
      largest = std::max(
          largest, std::abs(differences[static_cast<Index>(i)]) / unit_of(parameter, chain, units));
    }
  }
  return largest;
}

}  // namespace

void SymmetryTolerance::check() const {
  for (const double value : {length, angle, gain}) {
    if (!(value >= 0)) {
      throw InvalidInput("symmetry tolerance " + std::to_string(value) + "; expected zero or more");
    }
  }
}

ComparisonUnits comparison_units(const Mechanism& mechanism, const SymmetryTolerance& tolerance) {
  const ChainInfo& chain = mechanism.model().info();
  double base = 0;
  double platform = 0;
  for (const Leg& leg : mechanism.legs()) {
    const auto ends = {std::pair(base_end(chain, leg.parameters.data()), &base),
                       std::pair(platform_end(chain, leg.parameters.data()), &platform)};
    for (const auto& [end, farthest] : ends) {
      if (end.radius != nullptr) {
        // Two angles of a point in space.
        const double turns = end.polar_angle != nullptr ? std::sqrt(2) : 1;
        *farthest = std::max(*farthest, turns * std::abs(*end.radius));
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
    if (is_turning(chain.parameters[i], chain)) {
      double& difference = differences[static_cast<Index>(i)];
      difference = wrap_angle(difference);
    }
  }
  for (const bool platform : {false, true}) {
    const Anchor anchor = platform ? chain.platform_anchor : chain.base_anchor;
    const auto a = end_of(chain, leg, platform);
    const auto b = end_of(chain, other, platform);
    if (anchor != Anchor::point || a.azimuth == nullptr || a.radius == nullptr) {
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
  for (const bool platform : {false, true}) {
    const Anchor anchor = platform ? chain.platform_anchor : chain.base_anchor;
    const LegEnd<const double> end = end_of(chain, leg, platform);
    if (anchor == Anchor::line && end.radius != nullptr && *end.radius < 0) {
      turn_round(chain, result, platform);
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
  for (const bool platform : {false, true}) {
    const auto end = end_of(chain, leg, platform);
    const Anchor anchor = platform ? chain.platform_anchor : chain.base_anchor;
    const double unit = platform ? units.platform : units.base;
    if (end.azimuth == nullptr || end.radius == nullptr) {
      continue;
    }
    if (anchor == Anchor::point) {
      compare_points(chain, rewritten, leg, platform, differences, unit, worst);
      for (const double* const coordinate : {end.radius, end.azimuth, end.polar_angle}) {
        if (coordinate != nullptr) {
          done[static_cast<std::size_t>(coordinate - first)] = true;
        }
      }
    } else {
      const auto i = end.radius - first;
      note(worst, chain.parameters[static_cast<std::size_t>(i)].name, differences[i],
           std::abs(differences[i]) / unit);
      done[static_cast<std::size_t>(i)] = true;
    }
  }
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterInfo& parameter = chain.parameters[i];
    if (!done[i] && !is_sensor(parameter)) {
      const double deviation = differences[static_cast<Index>(i)];
      note(worst, parameter.name, deviation,
           std::abs(deviation) / unit_of(parameter, chain, units));
    }
  }
  worst.same_mode = rewritten.working_mode == leg.working_mode;
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
