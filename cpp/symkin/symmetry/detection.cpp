// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detection.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/leg_ends.hpp"

namespace symkin {
namespace {

constexpr double kPi = 3.141592653589793238463;

using End = LegEnd<const double>;

End end_of(const Mechanism& mechanism, Index leg, bool platform) {
  const double* parameters = mechanism.leg(leg).parameters.data();
  const ChainInfo& chain = mechanism.model().info();
  return platform ? platform_end(chain, parameters) : base_end(chain, parameters);
}

// The common centre of guides: each has the same distance rho from it, so
// distance from the origin = rho + u(azimuth) . centre. Shortest solution where it is not unique
// (two guides: anywhere on their bisector).
Eigen::Vector2d centre_of_guides(const Vector& distances, const Vector& azimuths) {
  Eigen::MatrixXd matrix(distances.size(), 3);
  matrix.col(0).setOnes();
  matrix.col(1) = azimuths.array().cos();
  matrix.col(2) = azimuths.array().sin();
  const Vector mean = matrix.colwise().mean();
  // rho is free: only what differs between the guides says where the centre is.
  const Eigen::MatrixXd centred = (matrix.rowwise() - mean.transpose()).rightCols(2);
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-6);
  solver.compute(centred);
  return solver.solve((distances.array() - distances.mean()).matrix());
}

// Where base or platform have their centre, if the legs are symmetric at all: the centroid of
// points is fixed by every symmetry of the set.
Eigen::Vector2d centre(const Mechanism& mechanism, bool platform) {
  const ChainInfo& chain = mechanism.model().info();
  const Anchor anchor = platform ? chain.platform_anchor : chain.base_anchor;
  const Index legs = mechanism.leg_count();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Vector distances(legs);
  Vector azimuths(legs);
  for (Index leg = 0; leg < legs; ++leg) {
    const End end = end_of(mechanism, leg, platform);
    if (end.azimuth == nullptr) {
      return Eigen::Vector2d::Zero();
    }
    const double sine = end.polar_angle != nullptr ? std::sin(*end.polar_angle) : 1;
    azimuths[leg] = *end.azimuth;
    // A guide without a distance of its own has it in the sensor's offset.
    distances[leg] = end.radius != nullptr ? *end.radius : mechanism.leg(leg).parameters.tail(1)[0];
    sum +=
        distances[leg] * sine * Eigen::Vector2d(std::cos(azimuths[leg]), std::sin(azimuths[leg]));
  }
  return anchor == Anchor::point ? Eigen::Vector2d(sum / static_cast<double>(legs))
                                 : centre_of_guides(distances, azimuths);
}

// Azimuth of a leg's end as seen from the centre.
double azimuth_from(const Mechanism& mechanism, Index leg, bool platform,
                    const Eigen::Vector2d& from) {
  const ChainInfo& chain = mechanism.model().info();
  const End end = end_of(mechanism, leg, platform);
  if (end.azimuth == nullptr) {
    return 0;
  }
  if ((platform ? chain.platform_anchor : chain.base_anchor) != Anchor::point) {
    return *end.azimuth;
  }
  const double sine = end.polar_angle != nullptr ? std::sin(*end.polar_angle) : 1;
  const Eigen::Vector2d point =
      *end.radius * sine * Eigen::Vector2d(std::cos(*end.azimuth), std::sin(*end.azimuth)) - from;
  return std::atan2(point.y(), point.x());
}

// Axis that mirrors every leg onto its partner, averaged over the legs; from 0 to pi.
double mirror_axis(const Mechanism& mechanism, const std::vector<Index>& partner, bool platform,
                   const Eigen::Vector2d& from) {
  double sine = 0;
  double cosine = 0;
  for (std::size_t leg = 0; leg < partner.size(); ++leg) {
    const double doubled = azimuth_from(mechanism, static_cast<Index>(leg), platform, from) +
                           azimuth_from(mechanism, partner[leg], platform, from);
    sine += std::sin(doubled);
    cosine += std::cos(doubled);
  }
  const double axis = std::atan2(sine, cosine) / 2;
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

// The reflection with the smallest axis, its frame; none if no pair of legs suggests one.
std::optional<SymmetryFrame> find_reflection(const Mechanism& mechanism,
                                             const SymmetryFrame& centred,
                                             const SymmetryTolerance& tolerance) {
  std::optional<SymmetryFrame> best;
  for (Index partner = 0; partner < mechanism.leg_count(); ++partner) {
    SymmetryFrame frame = centred;
    const auto halfway = [&](bool platform, const Eigen::Vector2d& from) {
      return (azimuth_from(mechanism, 0, platform, from) +
              azimuth_from(mechanism, partner, platform, from)) /
             2;
    };
    frame.base_axis = halfway(false, frame.base_centre);
    frame.platform_axis = halfway(true, frame.platform_centre);
    const ElementImage rough =
        image_of_legs(mechanism, SymmetryGroup(1, true, frame), {0, true}, tolerance);
    frame.base_axis = mirror_axis(mechanism, rough.permutation, false, frame.base_centre);
    frame.platform_axis = mirror_axis(mechanism, rough.permutation, true, frame.platform_centre);
    if (mechanism.pose_space() == PoseSpace::point) {
      frame.platform_axis = frame.base_axis;
    }
    const bool smaller = !best.has_value() || frame.base_axis < best->base_axis;
    if (smaller &&
        keeps_structure(mechanism, SymmetryGroup(1, true, frame), {0, true}, tolerance)) {
      best = frame;
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
bool is_mirrored(const ParameterInfo& parameter, SymmetryElement element, ActiveJoint joint) {
  switch (parameter.role) {
    case ParameterRole::base_azimuth:
    case ParameterRole::platform_azimuth:
      return element.reflection;
    case ParameterRole::offset:
      return reading_sign(element, joint) < 0;
    default:
      return false;
  }
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) {
    return *middle;
  }
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

}  // namespace

DetectedSymmetry detect_symmetry(const Mechanism& mechanism, const SymmetryTolerance& tolerance) {
  SymmetryFrame frame;
  frame.base_centre = centre(mechanism, false);
  frame.platform_centre = centre(mechanism, true);
  const int rotations = largest_rotation(mechanism, frame, tolerance);
  const auto reflection = find_reflection(mechanism, frame, tolerance);
  const SymmetryGroup structure(rotations, reflection.has_value(), reflection.value_or(frame));
  std::vector<ElementImage> images;
  for (const SymmetryElement element : structure.elements()) {
    images.push_back(image_of_legs(mechanism, structure, element, tolerance));
  }
  SymmetryGroup with_modes = mode_subgroup(structure, images);
  return {structure, std::move(with_modes), std::move(images)};
}

RowMatrix symmetry_deviations(const Mechanism& mechanism, const SymmetryGroup& group,
                              const SymmetryTolerance& tolerance) {
  const ChainInfo& chain = mechanism.model().info();
  const std::vector<Carrier> carriers = leg_carriers(mechanism, group, tolerance);
  // Every leg in the place of its reference, as a difference from the reference leg.
  RowMatrix differences(mechanism.leg_count(), mechanism.parameter_count());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Carrier& carrier = carriers[static_cast<std::size_t>(leg)];
    const Leg back =
        transform_leg(group, group.inverse(carrier.element), chain, mechanism.leg(leg));
    differences.row(leg) =
        parameter_differences(back, mechanism.leg(carrier.reference), chain).transpose();
  }
  RowMatrix deviations = differences;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
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
      if (is_mirrored(chain.parameters[static_cast<std::size_t>(i)], element, chain.active_joint)) {
        deviations(leg, i) = -deviations(leg, i);
      }
    }
  }
  return deviations;
}

}  // namespace symkin
