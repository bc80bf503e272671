// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/recognition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "symkin/chains/registry.hpp"
#include "symkin/model/sensor.hpp"

namespace symkin::declared {
namespace {

// A written number, or one that is not written and stays.
struct Number {
  int scalar = -1;
  double constant = 0;

  bool is_zero() const { return scalar < 0 && constant == 0; }
};

// A point that a transform carries, turned about z with its azimuth.
struct Point {
  Number azimuth, x, y, z;
};

Dual of_number(const Number& number, const Asked& asked) {
  Dual dual{number.constant, Vector::Zero(asked.slopes)};
  if (number.scalar >= 0) {
    dual.value = asked.parameters[number.scalar];
    if (asked.slopes > 0) {
      dual.slopes[number.scalar] = 1;
    }
  }
  return dual;
}

using Place = std::array<Dual, 3>;

Place place_of(const Point& point, const Asked& asked) {
  const Dual azimuth = of_number(point.azimuth, asked);
  const Dual x = of_number(point.x, asked);
  const Dual y = of_number(point.y, asked);
  const double c = std::cos(azimuth.value);
  const double s = std::sin(azimuth.value);
  Place place;
  place[0].value = c * x.value - s * y.value;
  place[1].value = s * x.value + c * y.value;
  place[0].slopes = c * x.slopes - s * y.slopes - place[1].value * azimuth.slopes;
  place[1].slopes = s * x.slopes + c * y.slopes + place[0].value * azimuth.slopes;
  place[2] = of_number(point.z, asked);
  return place;
}

Dual hypotenuse(const Dual& a, const Dual& b) {
  const double length = std::hypot(a.value, b.value);
  return {length, (a.value * a.slopes + b.value * b.slopes) / length};
}

// atan2(a, b)
Dual angle_of(const Dual& a, const Dual& b) {
  const double square = a.value * a.value + b.value * b.value;
  return {std::atan2(a.value, b.value), (b.value * a.slopes - a.value * b.slopes) / square};
}

// A point as the known chains have it: radius and azimuth about z, and a height; or a distance from
// the origin and the angle from z.
struct Polar {
  Dual radius, azimuth, height;
};

// A point less another one, if there is one.
struct End {
  Point own;
  std::optional<Point> less;

  Polar polar(const Asked& asked) const {
    if (!less && own.y.is_zero()) {  // exact on the axis too
      return {of_number(own.x, asked), of_number(own.azimuth, asked), of_number(own.z, asked)};
    }
    Place place = place_of(own, asked);
    if (less) {
      const Place other = place_of(*less, asked);
      for (std::size_t i = 0; i < 3; ++i) {
        place[i].value -= other[i].value;
        place[i].slopes -= other[i].slopes;
      }
    }
    return {hypotenuse(place[0], place[1]), angle_of(place[1], place[0]), place[2]};
  }
};

using Parameters = std::map<std::string_view, Source>;

// What a chain calls the coordinates of an end's point.
void add_end(Parameters& all, bool is_base, const End& end, bool spherical) {
  const auto name = [&](std::string_view of_base, std::string_view of_platform) {
    return is_base ? of_base : of_platform;
  };
  const auto azimuth = [end](const Asked& asked) { return end.polar(asked).azimuth; };
  all[name("base_angle", "platform_angle")] = azimuth;
  all[name("base_azimuth", "platform_azimuth")] = azimuth;
  all[name("base_height", "platform_height")] = [end](const Asked& asked) {
    return end.polar(asked).height;
  };
  all[name("base_radius", "platform_radius")] = [end, spherical](const Asked& asked) {
    const Polar polar = end.polar(asked);
    return spherical ? hypotenuse(polar.radius, polar.height) : polar.radius;
  };
  all[name("base_polar_angle", "platform_polar_angle")] = [end](const Asked& asked) {
    const Polar polar = end.polar(asked);
    return angle_of(polar.radius, polar.height);
  };
}

Source source_of(const Number& number) {
  return [number](const Asked& asked) { return of_number(number, asked); };
}

// Reads a path from its start, part by part, and remembers whether all was as expected.
class Reader {
 public:
  Reader(const Description& leg, const std::vector<Step>& steps) : leg_(leg), steps_(steps) {}

  bool ends() const { return fine_ && place_ == steps_.size(); }
  void fail() { fine_ = false; }

  // The next transform, of which numbers in other slots are neither written nor there.
  Point transform(std::initializer_list<Slot> allowed) {
    if (place_ >= steps_.size() || steps_[place_].kind != Step::Kind::transform) {
      fine_ = false;
      return {};
    }
    const int index = steps_[place_++].index;
    std::array<Number, kSlots> numbers;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      numbers[i].constant = leg_.transforms[static_cast<std::size_t>(index)][i];
    }
    for (std::size_t i = 0; i < leg_.scalars.size(); ++i) {
      if (leg_.scalars[i].transform == index) {
        numbers[static_cast<std::size_t>(leg_.scalars[i].slot)].scalar = static_cast<int>(i);
      }
    }
    for (int slot = 0; slot < kSlots; ++slot) {
      const bool may =
          std::find(allowed.begin(), allowed.end(), static_cast<Slot>(slot)) != allowed.end();
      fine_ = fine_ && (may || numbers[static_cast<std::size_t>(slot)].is_zero());
    }
    return {numbers[0], numbers[1], numbers[2], numbers[3]};
  }
  bool at_transform() const {
    return place_ < steps_.size() && steps_[place_].kind == Step::Kind::transform;
  }

  // The next joint, which stands by itself.
  const Joint& joint(JointKind kind) {
    static const Joint none;
    if (place_ >= steps_.size() || steps_[place_].kind != Step::Kind::joint) {
      fine_ = false;
      return none;
    }
    const Joint& joint = leg_.joints[static_cast<std::size_t>(steps_[place_++].index)];
    fine_ = fine_ && joint.kind == kind && joint.follows == Joint::kOwn;
    return joint;
  }
  bool at_joint(JointKind kind) const {
    return place_ < steps_.size() && steps_[place_].kind == Step::Kind::joint &&
           leg_.joints[static_cast<std::size_t>(steps_[place_].index)].kind == kind;
  }

  void pose() {
    fine_ = fine_ && place_ < steps_.size() && steps_[place_].kind == Step::Kind::pose;
    ++place_;
  }

 private:
  const Description& leg_;
  const std::vector<Step>& steps_;
  std::size_t place_ = 0;
  bool fine_ = true;
};

struct Found {
  std::string_view chain;
  Parameters parameters;
  Number turned{};  // what the known chain's joint angle has beside the declared one's
};

bool along(const Joint& joint, int axis) { return joint.axis[axis] == 1; }

// Of the platform's side what is left: a point of it, or nothing.
std::optional<Point> platform_point(const Description& leg, bool with_turns) {
  Reader right(leg, leg.loops.front().right);
  right.pose();
  Point point;
  if (right.at_transform()) {
    point = with_turns ? right.transform({Slot::azimuth, Slot::x, Slot::y, Slot::z, Slot::roll,
                                          Slot::pitch, Slot::yaw})
                       : right.transform({Slot::azimuth, Slot::x, Slot::y, Slot::z});
  }
  return right.ends() ? std::optional(point) : std::nullopt;
}

// [R]RR and R[R]R in the plane, on a platform that turns or on a point, and R[P]R.
std::optional<Found> planar(const Description& leg) {
  const Loop& loop = leg.loops.front();
  const bool whole = loop.compares == Compares::planar_pose;
  Reader left(leg, loop.left);
  const Point base = left.transform({Slot::azimuth, Slot::x, Slot::y});
  const std::optional<Point> platform = platform_point(leg, false);
  if (!platform || !platform->z.is_zero()) {
    return std::nullopt;
  }
  Found found{};
  const Joint& first = left.joint(JointKind::turn);
  if (left.at_joint(JointKind::slide)) {
    const Joint& read = left.joint(JointKind::slide);
    if (!read.read || !along(read, 0)) {
      return std::nullopt;
    }
    found.chain = "R[P]R";
  } else {
    found.parameters["proximal_length"] = source_of(left.transform({Slot::x}).x);
    const Joint& elbow = left.joint(JointKind::turn);
    found.parameters["distal_length"] = source_of(left.transform({Slot::x}).x);
    if (first.read == elbow.read) {
      return std::nullopt;
    }
    found.chain = first.read ? "[R]RR" : "R[R]R";
    if (first.read) {
      found.turned = base.azimuth;
    }
  }
  // On a point it turns nothing, and may be left out.
  if ((whole || left.at_joint(JointKind::turn)) && left.joint(JointKind::turn).read) {
    return std::nullopt;
  }
  if (!left.ends()) {
    return std::nullopt;
  }
  add_end(found.parameters, true, {base, {}}, false);
  add_end(found.parameters, false, {*platform, {}}, false);
  return found;
}

// What carries a rod: a slider along x or z, or a crank about y; or nothing, of a strut.
void read_carrier(Reader& left, Found& found, const Point& base) {
  if (left.at_joint(JointKind::slide)) {
    const Joint& slider = left.joint(JointKind::slide);
    if (!slider.read || !(along(slider, 0) || along(slider, 2))) {
      left.fail();
    }
    found.chain = "[P]US";
    found.parameters["guide_azimuth"] = source_of(base.azimuth);
    found.parameters["guide_elevation"] = source_of({-1, along(slider, 2) ? kPi / 2 : 0});
    found.parameters["guide_swing"] = source_of({});
  } else {
    const Joint& crank = left.joint(JointKind::turn);
    if (!crank.read || !along(crank, 1)) {
      left.fail();
    }
    found.chain = "[R]US";
    found.parameters["axis_azimuth"] = source_of(base.azimuth);
    found.parameters["axis_elevation"] = found.parameters["axis_swing"] = source_of({});
    found.parameters["proximal_length"] = source_of(left.transform({Slot::x}).x);
  }
}

// U[P]S, [P]US and [R]US, each with its strut or rod by two turns, or as a distance.
std::optional<Found> spatial(const Description& leg, bool translating) {
  const Loop& loop = leg.loops.front();
  const bool distance = loop.compares == Compares::distance;
  const std::optional<Point> platform = platform_point(leg, true);
  if (!platform || (!distance && loop.compares != Compares::point)) {
    return std::nullopt;
  }
  Found found{"U[P]S", {}, {}};
  Reader left(leg, loop.left);
  const bool is_cable = distance && loop.length_joint >= 0;
  // Where the strut begins, turns of the frame say nothing.
  Reader trial(leg, loop.left);
  static_cast<void>(trial.transform(
      {Slot::azimuth, Slot::x, Slot::y, Slot::z, Slot::roll, Slot::pitch, Slot::yaw}));
  bool strut = is_cable;
  if (!distance && trial.at_joint(JointKind::turn)) {
    const Joint& first = trial.joint(JointKind::turn);
    strut = trial.at_joint(JointKind::turn) && !first.read;
  }
  Point base;
  if (strut) {
    base = left.transform(
        {Slot::azimuth, Slot::x, Slot::y, Slot::z, Slot::roll, Slot::pitch, Slot::yaw});
    if (!is_cable) {
      const Joint& first = left.joint(JointKind::turn);
      const Joint& second = left.joint(JointKind::turn);
      const Joint& read = left.joint(JointKind::slide);
      if (!read.read || first.read || second.read || first.axis == second.axis ||
          read.axis == second.axis || read.axis == first.axis) {
        return std::nullopt;
      }
    }
  } else {
    base = left.transform({Slot::azimuth, Slot::x, Slot::y, Slot::z});
    read_carrier(left, found, base);
    if (distance) {
      if (left.at_transform()) {  // where the rod begins, which says nothing more
        static_cast<void>(left.transform({}));
      }
      Number length{-1, leg.transforms[static_cast<std::size_t>(loop.length_transform)][1]};
      for (std::size_t i = 0; i < leg.scalars.size(); ++i) {
        if (leg.scalars[i].transform == loop.length_transform) {
          length.scalar = static_cast<int>(i);
        }
      }
      found.parameters["distal_length"] = source_of(length);
    } else {
      const Joint& first = left.joint(JointKind::turn);
      const Joint& second = left.joint(JointKind::turn);
      const Point rod = left.transform({Slot::x, Slot::z});
      const bool along_x = rod.z.is_zero();
      if (first.read || second.read || first.axis == second.axis ||
          (!along_x && !rod.x.is_zero()) || along(second, along_x ? 0 : 2)) {
        return std::nullopt;
      }
      found.parameters["distal_length"] = source_of(along_x ? rod.x : rod.z);
    }
  }
  if (!left.ends()) {
    return std::nullopt;
  }
  const bool nowhere = platform->x.is_zero() && platform->y.is_zero() && platform->z.is_zero();
  const std::optional<Point> less =
      translating && !nowhere ? std::optional(*platform) : std::nullopt;
  add_end(found.parameters, true, {base, less}, strut);
  add_end(found.parameters, false, {*platform, {}}, strut);
  return found;
}

std::optional<Found> matched(const Declaration& declaration) {
  const Description& leg = declaration.leg;
  const bool shares = std::any_of(leg.scalars.begin(), leg.scalars.end(),
                                  [](const Scalar& each) { return !each.uses.empty(); });
  if (leg.loops.size() != 1 || shares) {
    return std::nullopt;
  }
  switch (declaration.pose_space) {
    case PoseSpace::planar:
    case PoseSpace::point:
      return planar(leg);
    case PoseSpace::spatial:
    case PoseSpace::translating:
      return spatial(leg, declaration.pose_space == PoseSpace::translating);
    case PoseSpace::spherical:
    case PoseSpace::schoenflies:
      break;
  }
  return std::nullopt;
}

Platform platform_of(PoseSpace space) {
  return space == PoseSpace::point         ? Platform::point
         : space == PoseSpace::translating ? Platform::translating
                                           : Platform::rigid;
}

}  // namespace

bool Recognised::parameters(ConstVector declared, Vector& values, RowMatrix* slopes) const {
  const Asked asked{declared.data(), slopes == nullptr ? 0 : declared.size()};
  const auto count = static_cast<Index>(sources_.size());
  values.resize(count);
  if (slopes != nullptr) {
    slopes->resize(count, declared.size());
  }
  bool finite = true;
  for (Index i = 0; i < count; ++i) {
    const Dual dual = sources_[static_cast<std::size_t>(i)](asked);
    values[i] = dual.value;
    finite = finite && std::isfinite(dual.value);
    if (slopes != nullptr) {
      slopes->row(i) = dual.slopes.transpose();
      finite = finite && dual.slopes.allFinite();
    }
  }
  return finite;
}

int Recognised::working_mode(ConstVector declared) const {
  const bool mirrored = declared[hand_] < 0;
  return mirrored && known_->info().mode_is_orientation ? -mode_ : mode_;
}

std::optional<Recognised> recognised(const Declaration& declaration) {
  constexpr double kSame = 1e-6;  // m or rad, of the reading at home
  std::optional<Found> found = matched(declaration);
  if (!found) {
    return std::nullopt;
  }
  const Description& leg = declaration.leg;
  const auto hand = static_cast<Index>(leg.scalars.size());
  const auto gain = static_cast<int>(hand) + 1;
  found->parameters["sensor_gain"] = source_of({gain, 1});
  found->parameters["sensor_offset"] = [gain, turned = found->turned](const Asked& asked) {
    Dual offset = of_number({gain + 1, 0}, asked);
    const Dual more = of_number(turned, asked);
    offset.value += more.value;
    offset.slopes += more.slopes;
    return offset;
  };
  const ChainModel& known = leg_model(found->chain, platform_of(declaration.pose_space));
  std::vector<Source> sources;
  for (const ParameterInfo& each : known.info().parameters) {
    const auto source = found->parameters.find(each.name);
    if (source == found->parameters.end()) {
      return std::nullopt;
    }
    sources.push_back(source->second);
  }
  Recognised made(known, std::move(sources), hand);
  Vector drawn(hand + 3);
  for (Index i = 0; i < hand; ++i) {
    const Scalar& scalar = leg.scalars[static_cast<std::size_t>(i)];
    drawn[i] = leg.transforms[static_cast<std::size_t>(scalar.transform)]
                             [static_cast<std::size_t>(scalar.slot)];
  }
  drawn.tail<3>() << 1, 1, 0;
  Vector own;
  RowMatrix slopes;
  if (!made.parameters(drawn, own, &slopes)) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < known.info().parameters.size(); ++i) {
    const ParameterInfo& each = known.info().parameters[i];
    if (each.role.kind == ParameterKind::length && own[static_cast<Index>(i)] <= 0) {
      return std::nullopt;
    }
  }
  double home = 0;
  const std::vector<int> by_themselves = own_joints(leg);
  for (std::size_t i = 0; i < by_themselves.size(); ++i) {
    if (leg.joints[static_cast<std::size_t>(by_themselves[i])].read) {
      home = declaration.home_joints[static_cast<Index>(i)];
    }
  }
  const RowMatrix pose = declaration.home_pose.transpose();
  for (const int mode : {1, -1}) {
    Vector reading(1), apart(1);
    known.inverse_kinematics(own, mode, pose, reading);
    known.reading_differences(own, reading, Vector::Constant(1, home), apart);
    if (std::abs(apart[0]) < kSame) {
      made.set_mode_at_home(mode);
      return made;
    }
  }
  return std::nullopt;
}

}  // namespace symkin::declared
