// SPDX-License-Identifier: MIT
#include "symkin/symmetry/carrying.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/detail/joint_map.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"
#include "symkin/symmetry/detail/leg_features.hpp"

namespace symkin {
namespace {

using Eigen::Vector3d;

constexpr double kOnAxis = 1e-9;  // m: nearer to it a point has no azimuth

// A point, as polar coordinates on that side of the axis on which `end` has it.
void set_point(const LegEnd<double>& end, const Vector3d& point) {
  const double across = std::hypot(point.x(), point.y());
  const double like = *end.azimuth;
  double azimuth = across > kOnAxis ? std::atan2(point.y(), point.x()) : like;
  double side = 1;
  if (end.polar_angle == nullptr && *end.radius < 0) {
    side = -1;
    azimuth = across > kOnAxis ? azimuth + kPi : like;
  }
  *end.azimuth = counted_like(azimuth, like);
  if (end.polar_angle != nullptr) {
    *end.polar_angle = std::atan2(across, point.z());
    *end.radius = point.norm();
    return;
  }
  *end.radius = side * across;
  if (end.height != nullptr) {
    *end.height = point.z();
  }
}

// Small angles of a direction from an azimuth: `first` lies along it at (0, 0), `across` at a swing
// of a quarter turn.
void set_direction(const Vector3d& direction, const Vector3d& first, const Vector3d& across,
                   double* elevation, double* swing) {
  *swing = std::asin(std::clamp(direction.dot(across), -1.0, 1.0));
  *elevation = counted_like(std::atan2(direction.z(), direction.dot(first)), *elevation);
}

Vector3d nearest_sense(const Vector3d& direction, const Vector3d& like) {
  return direction.dot(like) < 0 ? Vector3d(-direction) : direction;
}

class LegCarriage {
 public:
  LegCarriage(const ChainInfo& chain, const Leg& leg, const SymmetryPair& pair, const Leg& like)
      : chain_(chain), leg_(leg), pair_(pair), like_(like), image_(like) {}

  Leg run() {
    copy_links();
    const LegFeatures from = features_of(chain_, leg_);
    const LegFeatures onto = features_of(chain_, like_);
    for (const End which : kEnds) {
      const std::size_t side = which == End::base ? 0 : 1;
      if (is_declared(chain_)) {
        set_declared(which);
      } else if (chain_.pose_space == PoseSpace::spherical) {
        set_axis(which);
      } else if (which == End::base || has_orientation(chain_.pose_space)) {
        const LegEnd<double> end = leg_end(chain_, which, image_.parameters.data());
        position_size(chain_.pose_space) == 2 ? set_planar(end, which, from[side], onto[side])
                                              : set_spatial(end, which, from[side], onto[side]);
      }
    }
    set_sensor();
    return image_;
  }

 private:
  const Isometry& motion(End which) const {
    return which == End::base ? pair_.base : pair_.platform;
  }

  double handed() const { return pair_.improper() ? -1 : 1; }

  // What no motion changes; a declared leg is mirrored in each of its frames.
  void copy_links() {
    for (std::size_t i = 0; i < chain_.parameters.size(); ++i) {
      const auto [end, kind] = chain_.parameters[i].role;
      const auto place = static_cast<Index>(i);
      if (is_declared(chain_) && !is_of_frame(kind)) {
        const bool mirrored = pair_.improper() && is_mirrored(kind) && !stands_alike(kind);
        image_.parameters[place] = mirrored ? -leg_.parameters[place] : leg_.parameters[place];
      } else if (end == End::none) {
        image_.parameters[place] = leg_.parameters[place];
      }
    }
  }

  // The joints of a leg that a mirror leaves as they are have no other hand.
  bool stands_alike(ParameterKind kind) const {
    return kind == ParameterKind::handedness && chain_.mirror_image == MirrorImage::same;
  }

  double& of_image(End end, ParameterKind kind) {
    return *find_parameter(chain_, {end, kind}, image_.parameters.data());
  }

  void set_declared(End which) {
    Eigen::Matrix3d image = motion(which).linear * declared_frame(chain_, leg_, which);
    image.col(1) *= handed();
    set_declared_frame(chain_, which, image, image_);
  }

  // -1 moves no pose of a platform that turns about a point.
  void set_axis(End which) {
    const Vector3d axis =
        nearest_sense(motion(which).linear * meridian_frame(chain_, leg_, which).axis,
                      meridian_frame(chain_, like_, which).axis);
    const double across = std::hypot(axis.x(), axis.y());
    double& azimuth = of_image(which, ParameterKind::azimuth);
    const double turned = across > kOnAxis ? std::atan2(axis.y(), axis.x()) : azimuth;
    double& polar = of_image(which, ParameterKind::polar_angle);
    polar = counted_like(std::atan2(across, axis.z()), polar);
    azimuth = counted_like(turned, azimuth);
  }

  void set_planar(const LegEnd<double>& end, End which, const EndFeatures& from,
                  const EndFeatures& onto) {
    if (end.has_point()) {
      const auto own = leg_end(chain_, which, leg_.parameters.data());
      const Vector3d point =
          *own.radius * Vector3d(std::cos(*own.azimuth), std::sin(*own.azimuth), 0);
      set_point(end, motion(which)(point));
    }
    if (end.direction == nullptr) {
      return;
    }
    const bool placed = onto.lines.front().placed;
    Vector3d direction = nearest_sense(motion(which).linear * from.lines.front().direction,
                                       onto.lines.front().direction);
    // A guide is known by its normal: its travel runs a quarter turn ahead of it.
    const Vector3d normal = placed ? direction.cross(Vector3d::UnitZ()) : direction;
    *end.direction = counted_like(std::atan2(normal.y(), normal.x()), *end.direction);
    if (end.distance != nullptr) {
      *end.distance = normal.dot(motion(which)(from.lines.front().through));
    }
  }

  void set_spatial(const LegEnd<double>& end, End which, const EndFeatures& from,
                   const EndFeatures& onto) {
    const auto azimuth = [&](ParameterKind kind) { return of_image(which, kind); };
    const auto frame = [](double angle) {
      return std::pair(Vector3d(std::cos(angle), std::sin(angle), 0),
                       Vector3d(-std::sin(angle), std::cos(angle), 0));
    };
    std::size_t line = 0;
    if (end.has_point()) {
      const bool guided = end.guide_elevation != nullptr;
      set_point(end, motion(which)(guided ? from.lines.front().through : *from.point));
    }
    if (end.guide_elevation != nullptr) {
      const auto [radial, tangential] = frame(azimuth(ParameterKind::guide_azimuth));
      set_direction(nearest_sense(motion(which).linear * from.lines[line].direction,
                                  onto.lines[line].direction),
                    radial, tangential, end.guide_elevation, end.guide_swing);
      ++line;
    }
    if (end.axis_elevation != nullptr) {
      const auto [radial, tangential] = frame(azimuth(ParameterKind::axis_azimuth));
      const Vector3d axis = handed() * (motion(which).linear * from.lines[line].direction);
      set_direction(nearest_sense(axis, onto.lines[line].direction), tangential, radial,
                    end.axis_elevation, end.axis_swing);
    }
  }

  // Arcs arrive as they are or as what they lack of half a turn, whichever is like the other's; of
  // arcs of a quarter turn as they are.
  JointMap joints() {
    constexpr SymmetryTolerance kExact{1e-9, 1e-9, 1e-9};
    constexpr double kClearly = 0.05;  // rad
    std::vector<Index> arcs;
    for (std::size_t i = 0; i < chain_.parameters.size(); ++i) {
      if (chain_.parameters[i].role.kind == ParameterKind::arc) {
        arcs.push_back(static_cast<Index>(i));
      }
    }
    std::optional<JointMap> best;
    Leg found = image_;
    double least = std::numeric_limits<double>::infinity();
    const std::size_t ways = arcs.empty() ? 1 : 4;
    for (std::size_t way = 0; way < ways; ++way) {
      double apart = 0;
      for (std::size_t i = 0; i < arcs.size(); ++i) {
        const double own = leg_.parameters[arcs[i]];
        const bool reversed = ((way >> i) & 1U) != 0;
        image_.parameters[arcs[i]] = reversed ? kPi - own : own;
        apart += std::abs(image_.parameters[arcs[i]] - like_.parameters[arcs[i]]);
      }
      const auto map = joint_map(chain_, leg_, image_, pair_, kExact);
      if (map.has_value() && apart + (best.has_value() ? kClearly : 0) < least) {
        best = map;
        found = image_;
        least = apart;
      }
    }
    if (!best.has_value()) {
      throw InvalidInput("a leg " + std::string(chain_.name) + " has no image where it is carried");
    }
    image_ = found;
    return *best;
  }

  void set_sensor() {
    const JointMap map = joints();
    double& offset = of_image(End::none, ParameterKind::offset);
    offset = map.sign * offset + map.constant;
    if (is_angle(chain_.active_joint)) {
      offset = counted_like(offset, *find_parameter(chain_, {End::none, ParameterKind::offset},
                                                    like_.parameters.data()));
    }
    // The hand of a declared leg has gone with its links.
    image_.working_mode = (is_declared(chain_) ? 1 : map.mode_factor) * leg_.working_mode;
  }

  const ChainInfo& chain_;
  const Leg& leg_;
  const SymmetryPair& pair_;
  const Leg& like_;
  Leg image_;
};

}  // namespace

Leg carried_leg(const ChainInfo& chain, const Leg& leg, const SymmetryPair& pair, const Leg& like) {
  if (pair.exchange) {
    throw InvalidInput("a leg is carried by a pair that leaves base and platform their roles");
  }
  return LegCarriage(chain, leg, pair, like).run();
}

RowMatrix carried_derivatives(const ChainInfo& chain, const Leg& leg, const SymmetryPair& pair,
                              const Leg& like) {
  // Central differences of smooth functions of sizes about one: exact to some 1e-9.
  constexpr double kStep = 1e-5;
  const Index count = leg.parameters.size();
  const Leg image = carried_leg(chain, leg, pair, like);
  RowMatrix derivatives(count, count);
  for (Index i = 0; i < count; ++i) {
    std::array<Vector, 2> moved;
    for (std::size_t way = 0; way < 2; ++way) {
      Leg step = leg;
      step.parameters[i] += way == 0 ? kStep : -kStep;
      moved[way] = carried_leg(chain, step, pair, image).parameters;
    }
    derivatives.col(i) = (moved[0] - moved[1]) / (2 * kStep);
  }
  for (const End which : kEnds) {
    const auto end = leg_end(chain, which, image.parameters.data());
    if (!end.has_point() || is_declared(chain)) {
      continue;
    }
    const double sine = end.polar_angle != nullptr ? std::sin(*end.polar_angle) : 1;
    if (std::abs(*end.radius * sine) <= 1e-6) {
      derivatives.row(end.azimuth - image.parameters.data())
          .setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return derivatives;
}

}  // namespace symkin
