// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detail/joint_map.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "symkin/model/pose_space.hpp"
#include "symkin/symmetry/detail/leg_comparison.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"
#include "symkin/symmetry/detail/leg_features.hpp"

namespace symkin {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

int sign_of(double value) { return value < 0 ? -1 : 1; }

bool equal(double a, double b, double tolerance) {
  return std::abs(a - b) <= kImageTolerances * tolerance;
}

// The sense in which a guide arrives at leg `onto`'s, and how far along that its own zero lies.
struct GuideImage {
  int sense;
  double shift;
};

GuideImage guide_image(const LineFeature& from, const LineFeature& onto, const Isometry& motion) {
  return {sign_of((motion.linear * from.direction).dot(onto.direction)),
          onto.direction.dot(motion(from.through) - onto.through)};
}

JointMap planar_angle(const ChainInfo& chain, const LegFeatures& from, const LegFeatures& onto,
                      const SymmetryPair& pair) {
  const int handed = pair.improper() ? -1 : 1;
  JointMap map{handed, handed, 0};
  const std::array<const Isometry*, 2> motions{&pair.base, &pair.platform};
  for (std::size_t end = 0; end < 2; ++end) {
    if (!from[end].lines.empty()) {  // the passive guide tells the mode
      map.mode_factor =
          guide_image(from[end].lines.front(), onto[end].lines.front(), *motions[end]).sense;
    }
  }
  if (turned_end(chain.active_joint) != End::none) {
    const Matrix3d& linear =
        (turned_end(chain.active_joint) == End::base ? pair.base : pair.platform).linear;
    map.constant = std::atan2(linear(1, 0), linear(0, 0));
  }
  return map;
}

// Along a guide of one end. Guides at both ends cross in one point: there is one root.
JointMap travel(std::size_t end, const LegFeatures& from, const LegFeatures& onto,
                const SymmetryPair& pair) {
  const GuideImage image = guide_image(from[end].lines.front(), onto[end].lines.front(),
                                       end == 0 ? pair.base : pair.platform);
  const bool crossed = !from[0].lines.empty() && !from[1].lines.empty() && from[1].lines[0].placed;
  return {image.sense, crossed ? 1 : image.sense, image.shift};
}

// Between two points, or of a point from a guide that is known by its normal.
JointMap distance(const LegFeatures& from, const LegFeatures& onto, const SymmetryPair& pair) {
  for (std::size_t end = 0; end < 2; ++end) {
    if (!from[end].lines.empty() && !from[end].point.has_value()) {
      const Isometry& motion = end == 0 ? pair.base : pair.platform;
      const Vector3d& normal = onto[end].lines.front().direction;
      return {sign_of((motion.linear * from[end].lines.front().direction).dot(normal)), 1,
              normal.dot(motion.shift)};
    }
  }
  return {};
}

JointMap crank(const ChainInfo& chain, const Leg& from, const Leg& onto, const SymmetryPair& pair) {
  const AngleFrame a = crank_frame(chain, from);
  const AngleFrame b = crank_frame(chain, onto);
  const Matrix3d& linear = pair.base.linear;
  const int sense = sign_of((pair.improper() ? -1 : 1) * (linear * a.axis).dot(b.axis));
  const Vector3d zero = linear * a.zero;
  return {sense, sense, std::atan2(zero.dot(b.ahead), zero.dot(b.zero))};
}

// Axes may arrive reversed; then an arc arrives as what it lacks of half a turn. The axis in the
// middle is free to be the one or the other, as the arcs ask for.
std::optional<JointMap> spherical(const ChainInfo& chain, const Leg& from, const Leg& onto,
                                  const SymmetryPair& pair, const SymmetryTolerance& tolerance) {
  // -1 moves no pose, so an improper pair is the proper one that it makes with -1.
  const double proper = pair.improper() ? -1 : 1;
  const Matrix3d turn = proper * pair.base.linear;
  const AngleFrame a = meridian_frame(chain, from, End::base);
  const AngleFrame b = meridian_frame(chain, onto, End::base);
  const Vector3d v = proper * meridian_frame(chain, from, End::platform).axis;
  const int base = sign_of((turn * a.axis).dot(b.axis));
  const int platform =
      sign_of((pair.platform.linear * v).dot(meridian_frame(chain, onto, End::platform).axis));
  std::vector<std::size_t> arcs;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    if (chain.parameters[i].role.kind == ParameterKind::arc) {
      arcs.push_back(i);
    }
  }
  // A mirror's image comes first: there the middle axis goes with the others.
  const int first = pair.improper() ? -1 : 1;
  for (const int middle : {first, -first}) {
    const auto arrives = [&](std::size_t arc, int sense) {
      const auto place = static_cast<Index>(arcs[arc]);
      const double image = from.parameters[place];
      return equal(sense > 0 ? image : kPi - image, onto.parameters[place], tolerance.angle);
    };
    if (arrives(0, middle * base) && arrives(1, middle * platform)) {
      const Vector3d zero = middle * (turn * a.zero);
      return JointMap{base, base * platform * middle,
                      std::atan2(zero.dot(b.ahead), zero.dot(b.zero))};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<JointMap> joint_map(const ChainInfo& chain, const Leg& from, const Leg& onto,
                                  const SymmetryPair& pair, const SymmetryTolerance& tolerance) {
  const LegFeatures a = features_of(chain, from);
  const LegFeatures b = features_of(chain, onto);
  switch (chain.active_joint) {
    case ActiveJoint::angle_in_base:
    case ActiveJoint::angle_in_platform:
    case ActiveJoint::elbow_angle: {
      JointMap map = planar_angle(chain, a, b, pair);
      // (e, q) is (-e, q + half a turn) seen from the guide's other side.
      const std::size_t offset = chain.find({End::none, ParameterKind::eccentricity});
      if (offset < chain.parameters.size()) {
        const auto place = static_cast<Index>(offset);
        if (from.parameters[place] * onto.parameters[place] < 0 &&
            !equal(from.parameters[place], onto.parameters[place], tolerance.length)) {
          map.mode_factor = -map.mode_factor;
          map.constant = wrap_angle(map.constant + kPi);
        }
      }
      return map;
    }
    case ActiveJoint::travel_on_base:
    case ActiveJoint::travel_from_point:
      return travel(0, a, b, pair);
    case ActiveJoint::travel_on_platform:
      return travel(1, a, b, pair);
    case ActiveJoint::distance:
      return distance(a, b, pair);
    case ActiveJoint::angle_about_axis:
      return crank(chain, from, onto, pair);
    case ActiveJoint::angle_from_meridian:
      return spherical(chain, from, onto, pair, tolerance);
    case ActiveJoint::joint_turn:
    case ActiveJoint::mirrored_joint_turn:
    case ActiveJoint::joint_travel:
    case ActiveJoint::mirrored_joint_travel:
      break;
  }
  return JointMap{pair.improper() && is_mirrored(chain.active_joint) ? -1 : 1,
                  pair.improper() ? -1 : 1, 0};
}

bool arrives_in_mode(const ChainInfo& chain, const Leg& from, const Leg& onto,
                     const JointMap& map) {
  constexpr std::string_view kNone = "without meaning";
  if (is_declared(chain)) {
    return same_hand(chain, from, onto, map.mode_factor);
  }
  return chain.working_mode.substr(0, kNone.size()) == kNone ||
         from.working_mode * map.mode_factor == onto.working_mode;
}

double links_apart(const ChainInfo& chain, const Leg& from, const Leg& onto, bool improper,
                   bool exchange, const SymmetryTolerance& tolerance) {
  double largest = 0;
  std::vector<double> lengths[2];
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterKind kind = chain.parameters[i].role.kind;
    double image = from.parameters[static_cast<Index>(i)];
    double here = onto.parameters[static_cast<Index>(i)];
    const bool link = kind == ParameterKind::length || kind == ParameterKind::pulley_radius ||
                      kind == ParameterKind::eccentricity;
    const bool own = is_declared(chain) && !is_of_frame(kind) && !is_sensor(kind) &&
                     !is_mode(chain, chain.parameters[i]);
    if (!link && !own) {
      continue;
    }
    if (kind == ParameterKind::length && exchange) {
      lengths[0].insert(lengths[0].begin(), image);
      lengths[1].push_back(here);
      continue;
    }
    if (kind == ParameterKind::eccentricity) {
      image = std::abs(image);
      here = std::abs(here);
    }
    image = own && improper && is_mirrored(kind) ? -image : image;
    const bool angular = chain.is_angular(chain.parameters[i]);
    const double apart = angular ? wrap_angle(image - here) : image - here;
    largest = std::max(largest, std::abs(apart) / (angular ? tolerance.angle : tolerance.length));
  }
  for (std::size_t i = 0; i < lengths[0].size(); ++i) {
    largest = std::max(largest, std::abs(lengths[0][i] - lengths[1][i]) / tolerance.length);
  }
  return largest;
}

}  // namespace symkin
