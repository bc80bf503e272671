// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "symkin/support/dense.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/detail/leg_comparison.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"

namespace symkin {
namespace {

LegEnd<const double> end_of(const Mechanism& mechanism, Index leg, End end) {
  return leg_end(mechanism.model(leg).info(), end, mechanism.leg(leg).parameters.data());
}

Eigen::Vector2d along(double azimuth) { return {std::cos(azimuth), std::sin(azimuth)}; }

// Where an end's point is, seen along Z.
Eigen::Vector2d place_of(const LegEnd<const double>& end) {
  const double sine = end.polar_angle != nullptr ? std::sin(*end.polar_angle) : 1;
  return *end.radius * sine * along(*end.azimuth);
}

// A guide in the plane, and the chain of its leg.
struct Guide {
  const LegModel* chain;
  double distance, azimuth;
};

// The common centre of guides: those of each chain have one distance rho from it, so
// distance from the origin = rho + u(azimuth) . centre. Shortest solution where it is not unique
// (two guides: anywhere on their bisector).
Eigen::Vector2d centre_of_guides(const std::vector<Guide>& guides) {
  const auto count = static_cast<Index>(guides.size());
  Eigen::MatrixXd rows(count, 3);
  for (Index i = 0; i < count; ++i) {
    const Guide& guide = guides[static_cast<std::size_t>(i)];
    rows.row(i) << std::cos(guide.azimuth), std::sin(guide.azimuth), guide.distance;
  }
  // rho is free: only what differs between the guides of a chain says where the centre is.
  Eigen::MatrixXd centred = rows;
  for (Index i = 0; i < count; ++i) {
    std::vector<Index> alike;
    for (Index k = 0; k < count; ++k) {
      if (guides[static_cast<std::size_t>(k)].chain == guides[static_cast<std::size_t>(i)].chain) {
        alike.push_back(k);
      }
    }
    const Eigen::MatrixXd of_chain = rows(alike, kAll);
    centred.row(i) -= of_chain.colwise().mean();
  }
  return least_squares(centred.leftCols(2), centred.col(2), 1e-6);
}

// Where base or platform have their centre, if the legs are symmetric at all: the centroid of
// points is fixed by every symmetry of the set, whatever else there is.
Eigen::Vector2d centre(const Mechanism& mechanism, End which) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Index points = 0;
  std::vector<Guide> guides;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const LegModel& model = mechanism.model(leg);
    const LegEnd<const double> end = end_of(mechanism, leg, which);
    if (end.has_point()) {
      sum += place_of(end);
      ++points;
    } else if (end.direction != nullptr) {
      // A guide without a distance of its own has it in the sensor's offset.
      const double* const distance =
          end.distance != nullptr ? end.distance
                                  : find_parameter(model.info(), {End::none, ParameterKind::offset},
                                                   mechanism.leg(leg).parameters.data());
      guides.push_back({&model, *distance, *end.direction});
    }
  }
  if (points > 0) {
    return sum / static_cast<double>(points);
  }
  return guides.empty() ? Eigen::Vector2d(0, 0) : centre_of_guides(guides);
}

// A leg's end as seen from the centre, in the plane: a point's place, a guide's direction, where an
// axis through the centre leaves the unit sphere.
Eigen::Vector2d end_from(const Mechanism& mechanism, Index leg, End which,
                         const Eigen::Vector2d& from) {
  const LegEnd<const double> end = end_of(mechanism, leg, which);
  if (end.has_point()) {
    return place_of(end) - from;
  }
  if (end.polar_angle != nullptr) {
    return std::sin(*end.polar_angle) * along(*end.azimuth);
  }
  return end.direction != nullptr ? along(*end.direction) : Eigen::Vector2d::Zero();
}

// The leg whose end is farthest from the centre: of one at the centre the azimuth means nothing. A
// point comes before a guide, whose direction may be given the one way or the other.
Index farthest_leg(const Mechanism& mechanism, End end, const Eigen::Vector2d& from) {
  constexpr double kCentral = 1e-9;  // m
  Index farthest = 0;
  double distance = 0;
  for (const bool points : {true, false}) {
    if (distance > kCentral) {
      break;
    }
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      const double candidate = end_from(mechanism, leg, end, from).norm();
      if (end_of(mechanism, leg, end).has_point() == points && candidate > distance * (1 + 1e-6)) {
        farthest = leg;
        distance = candidate;
      }
    }
  }
  return farthest;
}

// Axis that mirrors every leg onto its partner, by least squares over the legs; from 0 to pi.
// Beside points a guide does not count: one that crosses the axis is its own image the other way
// round.
double mirror_axis(const Mechanism& mechanism, const std::vector<Index>& partner, End end,
                   const Eigen::Vector2d& from) {
  const auto has_point = [&](std::size_t leg) {
    return end_of(mechanism, static_cast<Index>(leg), end).has_point();
  };
  bool points = false;
  for (std::size_t leg = 0; leg < partner.size(); ++leg) {
    points = points || has_point(leg);
  }
  // Mirrored about the axis a, an end e becomes the conjugate of e turned by 2 a.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t leg = 0; leg < partner.size(); ++leg) {
    if (points && !has_point(leg)) {
      continue;
    }
    const Eigen::Vector2d a = end_from(mechanism, static_cast<Index>(leg), end, from);
    const Eigen::Vector2d b = end_from(mechanism, partner[leg], end, from);
    sum += Eigen::Vector2d(a.x() * b.x() - a.y() * b.y(), a.x() * b.y() + a.y() * b.x());
  }
  const double axis = std::atan2(sum.y(), sum.x()) / 2;
  return axis < 0 ? axis + kPi : axis;
}

bool keeps_structure(const Mechanism& mechanism, const SymmetryGroup& group,
                     SymmetryElement element, const SymmetryTolerance& tolerance) {
  return image_of_legs(mechanism, group, element, tolerance).keeps_structure;
}

int largest_rotation(const Mechanism& mechanism, const SymmetryFrame& frame,
                     const SymmetryTolerance& tolerance) {
  for (auto order = static_cast<int>(mechanism.leg_count()); order > 1; --order) {
    if (keeps_structure(mechanism, SymmetryGroup(order, false, frame), {1, false}, tolerance)) {
      return order;
    }
  }
  return 1;
}

// The axis halfway between two legs' ends.
double halfway(const Mechanism& mechanism, Index leg, Index partner, End end,
               const Eigen::Vector2d& from) {
  const Eigen::Vector2d a = end_from(mechanism, leg, end, from);
  const Eigen::Vector2d b = end_from(mechanism, partner, end, from);
  return (std::atan2(a.y(), a.x()) + std::atan2(b.y(), b.x())) / 2;
}

// A frame whose axes mirror one leg onto a partner at the base, and one at the platform, corrected
// by what these axes do to all legs.
SymmetryFrame mirror_frame(const Mechanism& mechanism, const SymmetryFrame& centred,
                           const std::array<Index, 2>& legs, const std::array<Index, 2>& partners,
                           const SymmetryTolerance& tolerance) {
  SymmetryFrame frame = centred;
  frame.base_axis = halfway(mechanism, legs[0], partners[0], End::base, frame.base_centre);
  frame.platform_axis =
      halfway(mechanism, legs[1], partners[1], End::platform, frame.platform_centre);
  const ElementImage rough =
      image_of_legs(mechanism, SymmetryGroup(1, true, frame), {0, true}, tolerance);
  frame.base_axis = mirror_axis(mechanism, rough.permutation, End::base, frame.base_centre);
  frame.platform_axis =
      mirror_axis(mechanism, rough.permutation, End::platform, frame.platform_centre);
  const auto at_centre = [&](End end, Index leg, const Eigen::Vector2d& from) {
    return end_from(mechanism, leg, end, from).norm() <= tolerance.length;
  };
  if (!has_orientation(mechanism.pose_space()) ||
      at_centre(End::platform, legs[1], frame.platform_centre)) {
    frame.platform_axis = frame.base_axis;
  } else if (at_centre(End::base, legs[0], frame.base_centre)) {
    frame.base_axis = frame.platform_axis;
  }
  return frame;
}

// The reflection with the smallest axis, its frame; none if no pair of legs suggests one.
std::optional<SymmetryFrame> find_reflection(const Mechanism& mechanism,
                                             const SymmetryFrame& centred,
                                             const SymmetryTolerance& tolerance) {
  std::optional<SymmetryFrame> best;
  const std::array<Index, 2> legs{farthest_leg(mechanism, End::base, centred.base_centre),
                                  farthest_leg(mechanism, End::platform, centred.platform_centre)};
  for (Index partner = 0; partner < mechanism.leg_count(); ++partner) {
    for (Index other = 0; other < mechanism.leg_count(); ++other) {
      if ((legs[0] == legs[1] && other != partner) || !mechanism.of_one_chain(legs[0], partner) ||
          !mechanism.of_one_chain(legs[1], other)) {
        continue;
      }
      const SymmetryFrame frame =
          mirror_frame(mechanism, centred, legs, {partner, other}, tolerance);
      const bool smaller = !best.has_value() || frame.base_axis < best->base_axis;
      if (smaller &&
          keeps_structure(mechanism, SymmetryGroup(1, true, frame), {0, true}, tolerance)) {
        best = frame;
      }
    }
  }
  return best;
}

// The subgroup of those elements that keep the working modes.
SymmetryGroup mode_subgroup(const SymmetryGroup& group, const std::vector<ElementImage>& images) {
  int rotations = 0;
  std::optional<double> axis;
  for (const ElementImage& image : images) {
    if (!image.keeps_modes) {
      continue;
    }
    if (!image.element.reflection) {
      ++rotations;
    } else if (!axis.has_value()) {
      axis = group.angle(image.element);
    }
  }
  SymmetryFrame frame = group.frame();
  frame.base_axis += axis.value_or(0);
  frame.platform_axis += axis.value_or(0);
  return {std::max(rotations, 1), axis.has_value(), frame};
}

// Whether a reflection changes the sign of a parameter's error.
bool changes_sign(const ParameterInfo& parameter, SymmetryElement element, ActiveJoint joint) {
  const ParameterKind kind = parameter.role.kind;
  return turns(kind) || is_mirrored(kind)
             ? element.reflection
             : kind == ParameterKind::offset && reading_sign(element, joint) < 0;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) {
    return *middle;
  }
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

SymmetryGroup largest_group(const Mechanism& mechanism, const SymmetryTolerance& tolerance) {
  SymmetryFrame frame;
  frame.base_centre = centre(mechanism, End::base);
  frame.platform_centre = centre(mechanism, End::platform);
  const int rotations = largest_rotation(mechanism, frame, tolerance);
  const auto reflection = find_reflection(mechanism, frame, tolerance);
  return {rotations, reflection.has_value(), reflection.value_or(frame)};
}

// The same legs, with the normals of all guides pointing away from the origins.
Mechanism with_guides_outward(const Mechanism& mechanism) {
  std::vector<Leg> legs;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    legs.push_back(with_guides_outward(mechanism.leg(leg), mechanism.model(leg).info()));
  }
  return mechanism.with_legs(std::move(legs));
}

}  // namespace

DetectedSymmetry detect_symmetry(const Mechanism& mechanism, const SymmetryTolerance& tolerance) {
  SymmetryGroup structure = largest_group(mechanism, tolerance);
  // About a centre off the origin normals may well point inward; as they are given comes first.
  const SymmetryGroup outward = largest_group(with_guides_outward(mechanism), tolerance);
  if (outward.size() > structure.size()) {
    structure = outward;
  }
  std::vector<ElementImage> images;
  for (const SymmetryElement element : structure.elements()) {
    images.push_back(image_of_legs(mechanism, structure, element, tolerance));
  }
  SymmetryGroup with_modes = mode_subgroup(structure, images);
  return {structure, std::move(with_modes), std::move(images)};
}

RowMatrix symmetry_deviations(const Mechanism& mechanism, const SymmetryGroup& group,
                              const SymmetryTolerance& tolerance) {
  const std::vector<Carrier> carriers = leg_carriers(mechanism, group, tolerance);
  // Every leg in the place of its reference, as a difference from the reference leg.
  RowMatrix differences(mechanism.leg_count(), mechanism.parameter_count());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Carrier& carrier = carriers[static_cast<std::size_t>(leg)];
    const ChainInfo& chain = mechanism.model(leg).info();
    const Leg back =
        transform_leg(group, group.inverse(carrier.element), chain, mechanism.leg(leg));
    differences.row(leg) =
        parameter_differences(back, mechanism.leg(carrier.reference), chain).transpose();
  }
  RowMatrix deviations = differences;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    for (Index i = 0; i < deviations.cols(); ++i) {
      std::vector<double> orbit;
      for (Index other = 0; other < mechanism.leg_count(); ++other) {
        if (carriers[static_cast<std::size_t>(other)].reference ==
            carriers[static_cast<std::size_t>(leg)].reference) {
          orbit.push_back(differences(other, i));
        }
      }
      deviations(leg, i) -= median(orbit);
      const SymmetryElement element = carriers[static_cast<std::size_t>(leg)].element;
      if (changes_sign(chain.parameters[static_cast<std::size_t>(i)], element,
                       chain.active_joint)) {
        deviations(leg, i) = -deviations(leg, i);
      }
    }
  }
  return deviations;
}

}  // namespace symkin
