// SPDX-License-Identifier: MIT
#include "symkin/symmetry/verification.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "symkin/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// Elements that carry a leg equally well differ by rounding only; the first of them is taken.
constexpr double kTie = 1e-3;  // tolerances

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

double tolerance_of(const ParameterInfo& parameter, const ChainInfo& chain,
                    const SymmetryTolerance& tolerance) {
  if (parameter.role == ParameterRole::gain) {
    return tolerance.gain;
  }
  return is_turning(parameter, chain) ? tolerance.angle : tolerance.length;
}

// The parameter by which two legs differ most, in tolerances.
LegDeviation compare(const Leg& image, const Leg& leg, const ChainInfo& chain,
                     const SymmetryTolerance& tolerance) {
  LegDeviation worst;
  const Vector differences = parameter_differences(leg, image, chain);
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterInfo& parameter = chain.parameters[i];
    const double deviation = differences[static_cast<Index>(i)];
    const double in_tolerances = std::abs(deviation) / tolerance_of(parameter, chain, tolerance);
    if (in_tolerances > worst.in_tolerances) {
      worst.parameter = parameter.name;
      worst.deviation = deviation;
      worst.in_tolerances = in_tolerances;
    }
  }
  worst.same_mode = image.working_mode == leg.working_mode;
  return worst;
}

LegDeviation nearest_leg(const Mechanism& mechanism, const Leg& image,
                         const SymmetryTolerance& tolerance) {
  LegDeviation nearest;
  nearest.in_tolerances = std::numeric_limits<double>::infinity();
  for (Index other = 0; other < mechanism.leg_count(); ++other) {
    LegDeviation candidate =
        compare(image, mechanism.leg(other), mechanism.model().info(), tolerance);
    if (candidate.in_tolerances < nearest.in_tolerances) {
      nearest = std::move(candidate);
      nearest.nearest = other;
    }
  }
  return nearest;
}

std::string describe(const SymmetryElement& element, const LegDeviation& deviation) {
  std::ostringstream text;
  text << "element " << SymmetryGroup::label(element) << " carries leg " << deviation.leg + 1
       << " nearest to leg " << deviation.nearest + 1 << ", whose " << deviation.parameter
       << " differs by " << deviation.deviation;
  return text.str();
}

}  // namespace

void SymmetryTolerance::check() const {
  for (const double value : {length, angle, gain}) {
    if (!(value >= 0)) {
      throw InvalidInput("symmetry tolerance " + std::to_string(value) + "; expected zero or more");
    }
  }
}

Vector parameter_differences(const Leg& leg, const Leg& other, const ChainInfo& chain) {
  Vector differences = leg.parameters - other.parameters;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    if (is_turning(chain.parameters[i], chain)) {
      double& difference = differences[static_cast<Index>(i)];
      difference = wrap_angle(difference);
    }
  }
  return differences;
}

ElementImage image_of_legs(const Mechanism& mechanism, const SymmetryGroup& group,
                           SymmetryElement element, const SymmetryTolerance& tolerance) {
  tolerance.check();
  ElementImage result;
  result.element = element;
  std::vector<bool> hit(static_cast<std::size_t>(mechanism.leg_count()), false);
  result.keeps_structure = true;
  result.keeps_modes = true;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Leg image = transform_leg(group, element, mechanism.model().info(), mechanism.leg(leg));
    LegDeviation deviation = nearest_leg(mechanism, image, tolerance);
    deviation.leg = leg;
    const auto target = static_cast<std::size_t>(deviation.nearest);
    result.keeps_structure &= deviation.in_tolerances <= 1 && !hit[target];
    result.keeps_modes &= deviation.same_mode;
    hit[target] = true;
    result.permutation.push_back(deviation.nearest);
    result.deviations.push_back(std::move(deviation));
  }
  result.keeps_modes &= result.keeps_structure;
  return result;
}

void verify_symmetry(const Mechanism& mechanism, const SymmetryGroup& group,
                     const SymmetryTolerance& tolerance) {
  for (const SymmetryElement element : group.elements()) {
    const ElementImage image = image_of_legs(mechanism, group, element, tolerance);
    if (image.keeps_structure) {
      continue;
    }
    for (const LegDeviation& deviation : image.deviations) {
      if (deviation.in_tolerances > 1) {
        throw SymmetryMismatch("mechanism \"" + mechanism.name() + "\" does not have the group " +
                               group.name() + ": " + describe(element, deviation));
      }
    }
    throw SymmetryMismatch("mechanism \"" + mechanism.name() + "\" does not have the group " +
                           group.name() + ": element " + SymmetryGroup::label(element) +
                           " carries two legs onto one");
  }
}

std::vector<Carrier> leg_carriers(const Mechanism& mechanism, const SymmetryGroup& group,
                                  const SymmetryTolerance& tolerance) {
  tolerance.check();
  const ChainInfo& chain = mechanism.model().info();
  const auto distance = [&](Index from, SymmetryElement element, Index to) {
    const Leg image = transform_leg(group, element, chain, mechanism.leg(from));
    const LegDeviation deviation = compare(image, mechanism.leg(to), chain, tolerance);
    return deviation.same_mode ? deviation.in_tolerances : std::numeric_limits<double>::infinity();
  };
  std::vector<Carrier> carriers;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    Carrier found{leg, {}};
    for (Index reference = 0; reference < leg && found.reference == leg; ++reference) {
      if (carriers[static_cast<std::size_t>(reference)].reference != reference) {
        continue;
      }
      double nearest = 1 + kTie;
      for (const SymmetryElement element : group.elements()) {
        const double candidate = distance(reference, element, leg);
        if (candidate < nearest - kTie) {
          found = {reference, element};
          nearest = candidate;
        }
      }
    }
    carriers.push_back(found);
  }
  return carriers;
}

std::vector<SymmetryElement> observability_group(const Mechanism& mechanism,
                                                 const SymmetryGroup& group,
                                                 const SymmetryTolerance& tolerance) {
  std::vector<SymmetryElement> elements;
  for (const Carrier& carrier : leg_carriers(mechanism, group, tolerance)) {
    if (carrier.reference != 0) {
      throw SymmetryMismatch("no element of " + group.name() + " carries leg 1 of mechanism \"" +
                             mechanism.name() + "\" onto leg " +
                             std::to_string(elements.size() + 1));
    }
    elements.push_back(carrier.element);
  }
  return elements;
}

}  // namespace symkin
