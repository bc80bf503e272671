// SPDX-License-Identifier: MIT
#include "symkin/symmetry/workspace_symmetry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/detail/joint_map.hpp"

namespace symkin {
namespace {

// An element with what it does to the joints.
struct Element {
  SymmetryPair pair;
  const ElementImage* image;
  std::vector<JointMap> joints;

  Index onto(Index leg) const { return image->permutation[static_cast<std::size_t>(leg)]; }
  const JointMap& joint(Index leg) const { return joints[static_cast<std::size_t>(leg)]; }
};

Element element_of(const Mechanism& mechanism, const SymmetryGroup& group,
                   const ElementImage& image, const SymmetryTolerance& tolerance) {
  Element element{pair_of(group, image.element), &image, {}};
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const auto joint = joint_map(mechanism.model(leg).info(), mechanism.leg(leg),
                                 mechanism.leg(element.onto(leg)), element.pair, tolerance);
    if (!joint.has_value()) {
      throw SymmetryMismatch("the arcs of leg " + std::to_string(leg + 1) +
                             " are not those of its image");
    }
    element.joints.push_back(*joint);
  }
  return element;
}

// The mechanism with the working modes that the element gives it: each leg's goes to the leg that
// its image is.
Mechanism with_image_modes(const Mechanism& mechanism, const Element& element) {
  std::vector<Leg> legs = mechanism.legs();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    legs[static_cast<std::size_t>(element.onto(leg))].working_mode =
        mechanism.leg(leg).working_mode * element.joint(leg).mode_factor;
  }
  return mechanism.with_legs(std::move(legs));
}

// The options of the image: home moves along, and so do the limits of readings that change sign
// if it is another mechanism, the one with the opposite modes.
WorkspaceOptions image_of_options(const Mechanism& mechanism, const Element& element,
                                  const WorkspaceOptions& options) {
  WorkspaceOptions result = options;
  result.home = transform_poses(element.pair, mechanism.pose_space(), options.home.transpose())
                    .row(0)
                    .transpose();
  if (element.image->keeps_modes) {
    return result;
  }
  const Vector lower = limits_of_legs(options.reading_lower, mechanism.leg_count());
  const Vector upper = limits_of_legs(options.reading_upper, mechanism.leg_count());
  result.reading_lower = lower;
  result.reading_upper = upper;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Index onto = element.onto(leg);
    const bool flips = element.joint(leg).sign < 0;
    result.reading_lower[onto] = flips ? -upper[leg] : lower[leg];
    result.reading_upper[onto] = flips ? -lower[leg] : upper[leg];
  }
  return result;
}

// Each image reading, at the leg that the image is, less the leg's own with its sign; angles by
// the shortest turn.
RowMatrix deviations(const Mechanism& mechanism, const Element& element, ConstRows image_readings,
                     ConstRows readings) {
  RowMatrix result(readings.rows(), readings.cols());
  Vector column(readings.rows());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    mechanism.model(leg).reading_differences(mechanism.leg(leg).parameters,
                                             image_readings.col(element.onto(leg)),
                                             element.joint(leg).sign * readings.col(leg), column);
    result.col(leg) = column;
  }
  return result;
}

// Poses of the box, and what the mechanism makes of them.
struct Drawn {
  RowMatrix poses;
  std::vector<bool> inside;
  RowMatrix readings;
};

Drawn seen_by(const Mechanism& mechanism, const WorkspaceOptions& options, RowMatrix poses) {
  std::vector<bool> inside = inside_workspace(mechanism, options, poses);
  RowMatrix readings = inverse_kinematics(mechanism, poses);
  return {std::move(poses), std::move(inside), std::move(readings)};
}

WorkspaceSymmetry compare(const Mechanism& mechanism, const Element& element, const Drawn& drawn,
                          const Drawn& carried) {
  WorkspaceSymmetry result;
  result.element = element.image->element;
  result.tested = drawn.poses.rows();
  result.keeps_modes = element.image->keeps_modes;
  const RowMatrix apart = deviations(mechanism, element, carried.readings, drawn.readings);
  for (Index i = 0; i < drawn.poses.rows(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const bool inside = drawn.inside[row];
    result.inside += inside ? 1 : 0;
    bool mismatch = inside != carried.inside[row];
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const double reading = drawn.readings(i, leg);
      const double image_reading = carried.readings(i, element.onto(leg));
      mismatch = mismatch || std::isfinite(reading) != std::isfinite(image_reading);
      // At the end of a leg's reach the readings carry the square root of the rounding.
      if (inside && std::isfinite(image_reading)) {
        result.reading_deviation = std::max(result.reading_deviation, std::abs(apart(i, leg)));
      }
    }
    result.unreachable += drawn.readings.row(i).allFinite() ? 0 : 1;
    result.mismatches += mismatch ? 1 : 0;
  }
  return result;
}

}  // namespace

std::vector<WorkspaceSymmetry> verify_workspace_symmetry(
    const Mechanism& mechanism, const WorkspaceOptions& options, const SymmetryGroup& group,
    const std::vector<SymmetryElement>& elements, Index count, std::uint64_t seed,
    const SymmetryTolerance& tolerance) {
  const Drawn drawn = seen_by(mechanism, options, draw_poses(mechanism, options, count, seed));
  std::vector<WorkspaceSymmetry> results;
  for (const SymmetryElement element : elements) {
    const ElementImage image = image_of_legs(mechanism, group, element, tolerance);
    if (!image.keeps_structure) {
      throw SymmetryMismatch("element " + SymmetryGroup::label(element) +
                             " does not map the legs of mechanism \"" + mechanism.name() +
                             "\" onto themselves");
    }
    const Element acting = element_of(mechanism, group, image, tolerance);
    if (element == SymmetryElement{}) {
      results.push_back(compare(mechanism, acting, drawn, drawn));
      continue;
    }
    const Drawn carried =
        seen_by(with_image_modes(mechanism, acting), image_of_options(mechanism, acting, options),
                transform_poses(acting.pair, mechanism.pose_space(), drawn.poses));
    results.push_back(compare(mechanism, acting, drawn, carried));
  }
  return results;
}

}  // namespace symkin
