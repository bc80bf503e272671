// SPDX-License-Identifier: MIT
#include "symkin/symmetry/verification.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/detail/joint_map.hpp"
#include "symkin/symmetry/detail/leg_comparison.hpp"

namespace symkin {
namespace {

// Elements that carry a leg equally well differ by rounding only; the first of them is taken.
constexpr double kTie = 1e-3;  // tolerances

// The leg that the image of a leg is nearest to, of those of its chain.
LegDeviation nearest_leg(const Mechanism& mechanism, Index leg, const Leg& image,
                         const ComparisonUnits& units) {
  LegDeviation nearest;
  nearest.in_tolerances = std::numeric_limits<double>::infinity();
  for (Index other = 0; other < mechanism.leg_count(); ++other) {
    if (!mechanism.of_one_chain(leg, other)) {
      continue;
    }
    LegDeviation candidate =
        compare_structure(image, mechanism.leg(other), mechanism.model(leg).info(), units);
    const bool same = candidate.same_mode && !nearest.same_mode;
    if (candidate.in_tolerances < nearest.in_tolerances - (same ? -kTie : 0)) {
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

ElementImage image_of_legs(const Mechanism& mechanism, const SymmetryGroup& group,
                           SymmetryElement element, const SymmetryTolerance& tolerance) {
  tolerance.check();
  ElementImage result;
  result.element = element;
  std::vector<bool> hit(static_cast<std::size_t>(mechanism.leg_count()), false);
  result.keeps_structure = true;
  result.keeps_modes = true;
  const ComparisonUnits units = comparison_units(mechanism, tolerance);
  const SymmetryPair pair = pair_of(group, element);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Leg image =
        transform_leg(group, element, mechanism.model(leg).info(), mechanism.leg(leg));
    LegDeviation deviation = nearest_leg(mechanism, leg, image, units);
    deviation.leg = leg;
    // A guide through the centre has no side: how it arrives, its direction says.
    const Leg& onto = mechanism.leg(deviation.nearest);
    const ChainInfo& chain = mechanism.model(leg).info();
    const auto joint = joint_map(chain, mechanism.leg(leg), onto, pair, tolerance);
    if (joint.has_value()) {
      deviation.same_mode = arrives_in_mode(chain, mechanism.leg(leg), onto, *joint);
    }
    const auto target = static_cast<std::size_t>(deviation.nearest);
    result.keeps_structure &= deviation.in_tolerances <= kImageTolerances && !hit[target];
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
      if (deviation.in_tolerances > kImageTolerances) {
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
  const ComparisonUnits units = comparison_units(mechanism, tolerance);
  std::vector<Carrier> carriers;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    Carrier found{leg, {}};
    for (Index reference = 0; reference < leg && found.reference == leg; ++reference) {
      if (carriers[static_cast<std::size_t>(reference)].reference != reference ||
          !mechanism.of_one_chain(leg, reference)) {
        continue;
      }
      double nearest = std::numeric_limits<double>::infinity();
      double sensor = nearest;
      for (const SymmetryElement element : group.elements()) {
        const Leg image = transform_leg(group, element, chain, mechanism.leg(reference));
        const Leg& here = mechanism.leg(leg);
        const LegDeviation deviation = compare_structure(image, here, chain, units);
        if (!deviation.same_mode || deviation.in_tolerances > kImageTolerances) {
          continue;
        }
        const double candidate = structure_apart(image, here, chain, units);
        const double of_sensor = sensors_apart(image, here, chain, units);
        if (candidate < nearest - kTie ||
            (candidate < nearest + kTie && of_sensor < sensor - kTie)) {
          found = {reference, element};
          nearest = std::min(nearest, candidate);
          sensor = of_sensor;
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
