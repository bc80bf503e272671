// SPDX-License-Identifier: MIT
#include "symkin/symmetry/action.hpp"

#include <cmath>
#include <string>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"

namespace symkin {
namespace {

// Rotation by a, or reflection about the line at a.
Eigen::Matrix2d linear_part(double a, bool reflection) {
  Eigen::Matrix2d part;
  if (reflection) {
    part << std::cos(2 * a), std::sin(2 * a), std::sin(2 * a), -std::cos(2 * a);
  } else {
    part << std::cos(a), -std::sin(a), std::sin(a), std::cos(a);
  }
  return part;
}

// The isometries of base and platform that an element stands for: p -> linear p + shift.
struct Isometries {
  double base_angle, platform_angle;  // of the rotation, or of the reflection line
  bool reflection;
  Eigen::Matrix2d base, platform;
  Eigen::Vector2d base_shift, platform_shift;

  double turned(double azimuth, End end) const {
    const double angle = end == End::platform ? platform_angle : base_angle;
    return reflection ? 2 * angle - azimuth : azimuth + angle;
  }
};

Isometries isometries(const SymmetryGroup& group, SymmetryElement element) {
  const SymmetryFrame& frame = group.frame();
  const double angle = group.angle(element);
  Isometries image;
  image.reflection = element.reflection;
  image.base_angle = element.reflection ? frame.base_axis + angle : angle;
  image.platform_angle = element.reflection ? frame.platform_axis + angle : angle;
  image.base = linear_part(image.base_angle, element.reflection);
  image.platform = linear_part(image.platform_angle, element.reflection);
  image.base_shift = frame.base_centre - image.base * frame.base_centre;
  image.platform_shift = frame.platform_centre - image.platform * frame.platform_centre;
  return image;
}

Eigen::Matrix3d spatial(const Eigen::Matrix2d& planar) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  matrix.topLeftCorner<2, 2>() = planar;
  return matrix;
}

// The polar coordinates of a point moved by `shift` in the plane.
void shift_point(const LegEnd<double>& end, const Eigen::Vector2d& shift) {
  const double sine = end.polar_angle != nullptr ? std::sin(*end.polar_angle) : 1;
  const double height = end.polar_angle != nullptr ? *end.radius * std::cos(*end.polar_angle) : 0;
  const Eigen::Vector2d direction(std::cos(*end.azimuth), std::sin(*end.azimuth));
  const Eigen::Vector2d point = *end.radius * sine * direction + shift;
  *end.radius = std::hypot(point.norm(), height);
  *end.azimuth += wrap_angle(std::atan2(point.y(), point.x()) - *end.azimuth);
  if (end.polar_angle != nullptr) {
    *end.polar_angle = std::atan2(point.norm(), height);
  }
}

// An end, turned already, under the shift of its frame's isometry. Returns what the sensor offset
// gains by it: from a guide that is read from the frame's origin, or from a travel along this end's
// guide, which begins at the point of the guide nearest to the origin.
double shift_end(const LegEnd<double>& end, bool is_travelled, const Eigen::Vector2d& shift) {
  if (shift.isZero(0)) {
    return 0;
  }
  if (end.has_point()) {
    shift_point(end, shift);
  }
  if (end.direction == nullptr) {
    return 0;
  }
  const Eigen::Vector2d normal(std::cos(*end.direction), std::sin(*end.direction));
  if (end.distance != nullptr) {
    *end.distance += shift.dot(normal);
    return is_travelled ? normal.x() * shift.y() - normal.y() * shift.x() : 0;
  }
  return end.distance_is_in_offset() ? shift.dot(normal) : 0;
}

double transform_offset(const Isometries& image, ActiveJoint joint, double offset) {
  if (turned_end(joint) != End::none) {
    return image.turned(offset, turned_end(joint));
  }
  return image.reflection && is_mirrored(joint) ? -offset : offset;
}

}  // namespace

SymmetryPair pair_of(const SymmetryGroup& group, SymmetryElement element) {
  const Isometries image = isometries(group, element);
  SymmetryPair pair;
  pair.base.linear = spatial(image.base);
  pair.base.shift.head<2>() = image.base_shift;
  pair.platform.linear = spatial(image.platform);
  pair.platform.shift.head<2>() = image.platform_shift;
  return pair;
}

RowMatrix transform_poses(const SymmetryGroup& group, SymmetryElement element, PoseSpace space,
                          ConstRows poses) {
  return transform_poses(pair_of(group, element), space, poses);
}

Leg transform_leg(const SymmetryGroup& group, SymmetryElement element, const ChainInfo& chain,
                  const Leg& leg) {
  if (leg.parameters.size() != static_cast<Index>(chain.parameters.size())) {
    throw InvalidInput("the leg has " + std::to_string(leg.parameters.size()) +
                       " parameters; chain " + std::string(chain.name) + " has " +
                       std::to_string(chain.parameters.size()));
  }
  const Isometries image = isometries(group, element);
  Leg result = leg;
  double* const parameters = result.parameters.data();
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const auto [end, kind] = chain.parameters[i].role;
    if (turns(kind)) {
      parameters[i] = image.turned(parameters[i], end);
    } else if (image.reflection && is_mirrored(kind)) {
      parameters[i] = 0 - parameters[i];  // without a sign of zero
    }
  }
  double& offset = *find_parameter(chain, {End::none, ParameterKind::offset}, parameters);
  offset = transform_offset(image, chain.active_joint, offset);
  for (const End end : kEnds) {
    offset += shift_end(leg_end(chain, end, parameters), travelled_end(chain.active_joint) == end,
                        end == End::base ? image.base_shift : image.platform_shift);
  }
  if (element.reflection && chain.mode_is_orientation) {
    result.working_mode = -leg.working_mode;
  }
  return result;
}

double reading_sign(SymmetryElement element, ActiveJoint joint) {
  return element.reflection && is_mirrored(joint) ? -1 : 1;
}

}  // namespace symkin
