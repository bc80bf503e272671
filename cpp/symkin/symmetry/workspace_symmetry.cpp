// SPDX-License-Identifier: MIT
#include "symkin/symmetry/workspace_symmetry.hpp"

#include <algorithm>
#include <cmath>

#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {
namespace {

// The mechanism with the working modes that the element gives it: each leg's goes to the leg that
// its image is.
Mechanism with_image_modes(const Mechanism& mechanism, const ElementImage& image) {
  std::vector<Leg> legs = mechanism.legs();
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Index onto = image.permutation[static_cast<std::size_t>(leg)];
    const bool flips = image.element.reflection && mechanism.model(leg).info().mode_is_orientation;
    legs[static_cast<std::size_t>(onto)].working_mode =
        mechanism.leg(leg).working_mode * (flips ? -1 : 1);
  }
  return mechanism.with_legs(std::move(legs));
}

// The options of the image: home moves along, and so do the limits of readings that change sign
// if it is another mechanism, the one with the opposite modes.
WorkspaceOptions image_of_options(const Mechanism& mechanism, const SymmetryGroup& group,
                                  const ElementImage& image, const WorkspaceOptions& options) {
  WorkspaceOptions result = options;
  result.home =
      transform_poses(group, image.element, mechanism.pose_space(), options.home.transpose())
          .row(0)
          .transpose();
  if (image.keeps_modes) {
    return result;
  }
  const Vector lower = limits_of_legs(options.reading_lower, mechanism.leg_count());
  const Vector upper = limits_of_legs(options.reading_upper, mechanism.leg_count());
  result.reading_lower = lower;
  result.reading_upper = upper;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Index onto = image.permutation[static_cast<std::size_t>(leg)];
    const bool flips = reading_sign(image.element, mechanism.model(leg).info().active_joint) < 0;
    result.reading_lower[onto] = flips ? -upper[leg] : lower[leg];
    result.reading_upper[onto] = flips ? -lower[leg] : upper[leg];
  }
  return result;
}

// Each image reading, at the leg that the image is, less the leg's own with its sign; angles by
// the shortest turn.
RowMatrix deviations(const Mechanism& mechanism, const ElementImage& image,
                     ConstRows image_readings, ConstRows readings) {
  RowMatrix result(readings.rows(), readings.cols());
  Vector column(readings.rows());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const LegModel& model = mechanism.model(leg);
    const double sign = reading_sign(image.element, model.info().active_joint);
    model.reading_differences(mechanism.leg(leg).parameters,
                              image_readings.col(image.permutation[static_cast<std::size_t>(leg)]),
                              sign * readings.col(leg), column);
    result.col(leg) = column;
  }
  return result;
}

}  // namespace

WorkspaceSymmetry verify_workspace_symmetry(const Mechanism& mechanism,
                                            const WorkspaceOptions& options,
                                            const SymmetryGroup& group, SymmetryElement element,
                                            Index count, std::uint64_t seed,
                                            const SymmetryTolerance& tolerance) {
  const ElementImage image = image_of_legs(mechanism, group, element, tolerance);
  if (!image.keeps_structure) {
    throw SymmetryMismatch("element " + SymmetryGroup::label(element) +
                           " does not map the legs of mechanism \"" + mechanism.name() +
                           "\" onto themselves");
  }
  const RowMatrix poses = draw_poses(mechanism, options, count, seed);
  const PoseSpace space = mechanism.pose_space();
  const RowMatrix image_poses = transform_poses(group, element, space, poses);
  const Mechanism image_mechanism = with_image_modes(mechanism, image);
  const WorkspaceOptions image_options = image_of_options(mechanism, group, image, options);

  WorkspaceSymmetry result;
  result.element = element;
  result.tested = count;
  result.keeps_modes = image.keeps_modes;
  const std::vector<bool> inside = inside_workspace(mechanism, options, poses);
  const std::vector<bool> image_inside =
      inside_workspace(image_mechanism, image_options, image_poses);
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  const RowMatrix image_readings = inverse_kinematics(image_mechanism, image_poses);
  const RowMatrix apart = deviations(mechanism, image, image_readings, readings);
  for (Index i = 0; i < count; ++i) {
    const auto row = static_cast<std::size_t>(i);
    result.inside += inside[row] ? 1 : 0;
    bool mismatch = inside[row] != image_inside[row];
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const double reading = readings(i, leg);
      const double image_reading =
          image_readings(i, image.permutation[static_cast<std::size_t>(leg)]);
      mismatch = mismatch || std::isfinite(reading) != std::isfinite(image_reading);
      // At the end of a leg's reach the readings carry the square root of the rounding.
      if (inside[row] && std::isfinite(image_reading)) {
        result.reading_deviation = std::max(result.reading_deviation, std::abs(apart(i, leg)));
      }
    }
    result.unreachable += readings.row(i).allFinite() ? 0 : 1;
    result.mismatches += mismatch ? 1 : 0;
  }
  return result;
}

}  // namespace symkin
