// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/assembly.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>
#include <string>

#include "symkin/chains/declared/pivoted_qr.hpp"
#include "symkin/model/impossible_leg.hpp"

namespace symkin::declared {
namespace {

using Eigen::Vector3d;

constexpr double kNothing = 1e-7;  // of the largest pivot: no direction of its own
constexpr double kClosed = 1e-9;   // m and rad
constexpr double kAside = 1e-6;    // m or rad, for a difference

int rank_of(const Columns& columns) {
  if (columns.cols() == 0) {
    return 0;
  }
  Eigen::ColPivHouseholderQR<Columns> qr(columns);
  qr.setThreshold(kNothing);
  return static_cast<int>(qr.rank());
}

// The columns that stand for all, ascending.
std::vector<int> basis_of(const Columns& columns, const std::vector<int>& chosen, int rank) {
  const PivotedQr qr(columns, chosen, rank);
  std::vector<int> basis;
  basis.reserve(static_cast<std::size_t>(rank));
  for (int i = 0; i < rank; ++i) {
    basis.push_back(qr.column(i));
  }
  std::sort(basis.begin(), basis.end());
  return basis;
}

// Mirrored in the plane of x and z of its frame, a turn about y and a slide along x or z stay.
double mirror_sign(const Joint& joint) {
  const bool along_y = std::abs(joint.axis.y()) > 0.5;
  return along_y == (joint.kind == JointKind::turn) ? 1 : -1;
}

// There x and z of a transform and its turn about y stay, as ratios do that are x or z.
double mirror_sign(Slot slot) {
  return slot == Slot::x || slot == Slot::z || slot == Slot::pitch || slot == Slot::ry ? 1 : -1;
}

// By how much a mirror scales the volume that twists span where this is compared.
double mirrored_volume(Compares compares) {
  return compares == Compares::pose || compares == Compares::point ||
                 compares == Compares::planar_point
             ? -1
             : 1;
}

// 1 where an order is an even number of exchanges away from the ascending one, else -1.
double sign_of(const std::vector<int>& order) {
  double sign = 1;
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      sign = order[k] > order[i] ? -sign : sign;
    }
  }
  return sign;
}

int count_of(unsigned rows) { return static_cast<int>(std::bitset<kMostEquations>(rows).count()); }

// Of columns that reach so many of the equations: those that reach few first.
Elimination elimination_of(const std::vector<int>& columns, const std::vector<unsigned>& reach,
                           int equations) {
  const auto reached = [&](int position) {
    return reach[static_cast<std::size_t>(columns[static_cast<std::size_t>(position)])];
  };
  std::vector<int> order(columns.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return count_of(reached(a)) < count_of(reached(b)); });
  Elimination made;
  std::vector<unsigned> mirrors;
  std::vector<int> axes;
  unsigned used = 0;
  for (const int position : order) {
    Elimination::Mirror& mirror = made.mirrors[made.rank++];
    mirror = {columns[static_cast<std::size_t>(position)], 0, 0, {}, 0, {}};
    unsigned rows = reached(position);
    for (std::size_t i = 0; i < mirrors.size(); ++i) {
      if ((mirrors[i] & rows) != 0) {
        rows |= mirrors[i];
        mirror.earlier[mirror.earlier_count++] = static_cast<int>(i);
      }
    }
    const auto take = [&](unsigned some) {
      for (int row = 0; row < equations; ++row) {
        if ((some >> row & 1U) != 0) {
          mirror.rows[mirror.row_count++] = row;
        }
      }
    };
    take(rows & ~used);
    mirror.mirrored = mirror.row_count;
    take(rows & used);
    mirrors.push_back(rows & ~used);
    axes.push_back(mirror.rows[0]);
    used |= 1U << mirror.rows[0];
  }
  for (int row = 0, i = 0; row < equations; ++row) {
    if ((used >> row & 1U) == 0) {
      made.left[i++] = row;
      axes.push_back(row);
    }
  }
  made.sign = sign_of(order) * sign_of(axes);
  return made;
}

Pose between(const Pose& from, const Pose& to, double share) {
  const Eigen::Quaterniond start(from.rotation), end(to.rotation);
  return {start.slerp(share, end).toRotationMatrix(),
          (1 - share) * from.position + share * to.position};
}

}  // namespace

int binding_closures(const Description& leg, const Home& home, bool passive) {
  Loops loops(leg);
  loops.walk(home.pose, home.joints);
  std::vector<int> met;
  for (std::size_t i = 0; i < loops.own().size(); ++i) {
    if (!passive || !leg.joints[static_cast<std::size_t>(loops.own()[i])].read) {
      met.push_back(static_cast<int>(i));
    }
  }
  return loops.equations() - rank_of(loops.columns()(kAll, met));
}

Assembly::Assembly(const Description& leg, const Home& home)
    : loops_(leg), home_(home), home_joints_(home.joints) {
  const std::vector<int>& own = loops_.own();
  mirror_signs_.resize(static_cast<Index>(own.size()));
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Joint& joint = leg.joints[static_cast<std::size_t>(own[i])];
    (joint.read ? read_ : passive_).push_back(static_cast<int>(i));
    all_.push_back(static_cast<int>(i));
    mirror_signs_[static_cast<Index>(i)] = mirror_sign(joint);
  }
  std::vector<double> ratio_signs(leg.joints.size(), 1);
  for (const Scalar& scalar : leg.scalars) {
    const double sign = mirror_sign(scalar.slot);
    for (const Use& use : scalar.uses) {
      if (use.at.kind == Step::Kind::joint) {
        ratio_signs[static_cast<std::size_t>(use.at.index)] = sign;
      } else {
        can_be_mirrored_ = can_be_mirrored_ && mirror_sign(use.slot) == sign;
      }
    }
  }
  for (std::size_t i = 0; i < leg.joints.size(); ++i) {
    const Joint& joint = leg.joints[i];
    if (joint.follows != Joint::kOwn) {
      const double followed = joint.follows >= 0
                                  ? mirror_sign(leg.joints[static_cast<std::size_t>(joint.follows)])
                                  : -1;
      const double sign = mirror_sign(joint);
      can_be_mirrored_ =
          can_be_mirrored_ && sign == ratio_signs[i] * followed && (sign > 0 || joint.offset == 0);
    }
  }
  walk(home.pose, home.joints);
  const Columns columns = loops_.columns();
  passive_rank_ = rank_of(columns(kAll, passive_));
  whole_rank_ = rank_of(columns);
  basis_ = basis_of(columns, passive_, passive_rank_);
  for (const std::vector<int>* const joints : {&passive_, &read_}) {
    moving_passive_ = static_cast<int>(moving_.size());
    const auto moves = [&](int joint) { return !columns.col(joint).isZero(0); };
    std::copy_if(joints->begin(), joints->end(), std::back_inserter(moving_), moves);
  }
  closures_ = loops_.equations() - passive_rank_;
  find_elimination();
  if (closures_ < 1) {
    const auto freedoms = static_cast<std::size_t>(passive_rank_) + read_.size();
    throw InvalidInput("a leg with " + std::to_string(freedoms) +
                       " freedoms: its passive joints alone meet all " +
                       std::to_string(loops_.equations()) +
                       " equations of its loops, so that it binds nothing; expected fewer joints, "
                       "or a ball or rods where a link may spin");
  }
  if (whole_rank_ - passive_rank_ < static_cast<int>(read_.size())) {
    throw InvalidInput(
        "a passive joint does at home what a read one does: the leg is singular "
        "there, or the sensor shows nothing");
  }
  if (read_.size() == 1) {
    home_side_ = drawn_side_ = by_first_reading();
    mirrored_side_ = mirror_signs_[read_.front()] * drawn_side_;
    for (const int each : basis_) {
      mirrored_side_ *= mirror_signs_[each];
    }
    for (const Loop& loop : leg.loops) {
      mirrored_side_ *= mirrored_volume(loop.compares);
    }
  }
}

void Assembly::find_elimination() {
  if (passive_rank_ < moving_passive_ || whole_rank_ < static_cast<int>(moving_.size())) {
    return;
  }
  // Where several unit vectors might be the closures the order decides which they are.
  const bool any = closures_ > (read_.empty() ? 1 : 2);
  const unsigned whole = (1U << loops_.equations()) - 1;
  const std::vector<unsigned> reach =
      any ? std::vector<unsigned>(loops_.own().size(), whole) : loops_.reach();
  const std::vector<int> passive(moving_.begin(), moving_.begin() + moving_passive_);
  elimination_ = std::make_shared<const std::array<Elimination, 2>>(
      std::array{elimination_of(moving_, reach, loops_.equations()),
                 elimination_of(passive, reach, loops_.equations())});
}

MirrorImage Assembly::mirror_image() const {
  if (!can_be_mirrored_) {
    return MirrorImage::none;
  }
  bool same = closures_ != 1 || mirrored_side_ == drawn_side_;  // which several have not
  for (Index i = 0; i < mirror_signs_.size(); ++i) {
    const bool stays = mirror_signs_[i] > 0 || std::abs(home_.joints[i]) < kClosed;
    same = same && stays;
  }
  return same ? MirrorImage::same : MirrorImage::other_hand;
}

void Assembly::set_leg(ConstVector scalars, bool mirrored) {
  known_here_ = false;
  if (mirrored && !can_be_mirrored_) {
    throw ImpossibleLeg(
        "a joint that follows another one, or a number that names one, stays in a mirror where "
        "that one turns round, so the declared leg has no mirror image; expected working_mode = 1");
  }
  loops_.set_scalars(scalars);
  home_side_ = mirrored ? mirrored_side_ : drawn_side_;
  home_joints_ = mirrored ? Joints(home_.joints.cwiseProduct(mirror_signs_)) : home_.joints;
}

bool Assembly::lane_leg(std::vector<LaneTransform>& transforms, LaneLeg& leg) const {
  if (read_.size() > 1 || !elimination_) {
    return false;
  }
  leg = loops_.lane_leg(transforms);
  leg.home = home_joints_.data();
  leg.moving = &elimination_->front();
  leg.passive = &elimination_->back();
  leg.read = read_.empty() ? -1 : read_.front();
  leg.side = read_.size() == 1 && closures_ == 1 ? home_side_ : 0;
  leg.exact = whole_rank_ == loops_.equations();
  return true;
}

void Assembly::walk(const Pose& pose, const Joints& joints) {
  loops_.walk(pose, joints);
  known_here_ = false;
}

// Newton's method, or Gauss's where the equations are more; joints that only spin stay. Behind a
// short step the derivatives serve once more, which mostly ends it. Even where two branches meet
// steps are halved by each step: where they are not by several, the pose is out of reach.
bool Assembly::newton(const Pose& pose, const std::vector<int>& moving, int rank, Joints& joints) {
  constexpr int kMost = 30;
  constexpr int kPatience = 6;
  constexpr double kLongest = 0.5;  // m and rad
  constexpr double kShort = 1e-5;
  constexpr double kNoStep = 1e-9;
  walk(pose, joints);
  if (rank == 0) {
    return true;
  }
  double shortest = std::numeric_limits<double>::infinity();
  for (int i = 0, since = 0; i < kMost && since < kPatience; ++i) {
    const PivotedQr qr(loops_.columns(), moving, rank);
    const auto take_step = [&] {
      const Joints step = qr.solve(loops_.residual());
      const double largest = step.cwiseAbs().maxCoeff();
      const double share = largest > kLongest ? kLongest / largest : 1;
      for (int k = 0; k < rank; ++k) {
        joints[qr.column(k)] -= share * step[k];
      }
      loops_.walk(joints);
      return largest;
    };
    const double largest = take_step();
    if (!std::isfinite(largest)) {
      return false;
    }
    if (largest < kNoStep || (largest < kShort && take_step() < kNoStep)) {
      return true;
    }
    since = largest < shortest / 2 ? 0 : since + 1;
    shortest = since == 0 ? largest : shortest;
  }
  return false;
}

bool Assembly::on_branch() {
  return loops_.on_this_side_of_half_a_turn() &&
         (read_.size() != 1 || closures_ != 1 || (by_first_reading() > 0) == (home_side_ > 0));
}

// d/dreading of the first closure, with the sign of the side of the leg's singularity.
double Assembly::by_first_reading() { return reciprocal().col(0).dot(columns_.col(read_.front())); }

// Of the reciprocal wrenches behind the passive joints' columns.
double Assembly::orientation(const PivotedQr& qr) const {
  if (basis_.size() == passive_.size()) {
    return qr.orientation();
  }
  Columns square(loops_.equations(), loops_.equations());
  for (int i = 0; i < passive_rank_; ++i) {
    square.col(i) = columns_.col(basis_[static_cast<std::size_t>(i)]);
  }
  square.rightCols(reciprocal_.cols()) = reciprocal_;
  return square.determinant();
}

bool Assembly::near_home(const Pose& pose, Joints& joints) {
  const bool exact = whole_rank_ == loops_.equations();
  return newton(pose, all_, whole_rank_, joints) && on_branch() &&
         (!exact || loops_.residual().cwiseAbs().maxCoeff() < kClosed);
}

bool Assembly::close(const Pose& pose, Joints& joints) {
  joints = home_joints_;
  return near_home(pose, joints) || follow(pose, joints);
}

Pose Assembly::on_the_way(const Pose& pose, double share) const {
  return between(home_.pose, pose, share);
}

// From home by steps as short as they must be. Where neither the longest nor the shortest leaves
// home those between are left out: poses in another unit, and all poses of a leg with wrong
// numbers, are out of reach by far.
bool Assembly::follow(const Pose& pose, Joints& joints) {
  const auto [shortest, longest] = kTriedShares;
  const auto leaves_home = [&](double share) {
    joints = home_joints_;
    return near_home(on_the_way(pose, share), joints);
  };
  if (!leaves_home(shortest) && !leaves_home(longest)) {
    return false;
  }
  joints = home_joints_;
  double done = 0;
  double step = longest;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    Joints trial = joints;
    if (near_home(on_the_way(pose, next), trial) &&
        (trial - joints).cwiseAbs().maxCoeff() < kFarthest) {
      joints = trial;
      done = next;
    } else if ((step /= 2) < shortest) {
      return false;
    }
  }
  return true;
}

bool Assembly::close_around_readings(const Pose& pose, Joints& joints) {
  Joints from_home = home_joints_;
  for (const int each : read_) {
    from_home[each] = joints[each];
  }
  const Joints given = from_home;
  if (newton(pose, passive_, passive_rank_, from_home) && on_branch()) {
    joints = from_home;
    return true;
  }
  Joints around;
  if (close(pose, around)) {
    for (const int each : read_) {
      around[each] = given[each];
    }
    if (newton(pose, passive_, passive_rank_, around)) {
      joints = around;
      return true;
    }
  }
  joints = from_home;
  walk(pose, joints);
  return false;
}

double Assembly::reach_margin(const Pose& pose, const std::vector<int>& tangent) {
  Joints joints;
  if (!close(pose, joints)) {
    return missed(pose);
  }
  if (read_.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  std::vector<double> slopes;
  for (const Pose& there : around(pose, tangent)) {
    Joints moved = joints;
    newton(there, all_, whole_rank_, moved);
    slopes.push_back(by_first_reading());
  }
  return margin_of(slopes.data(), slopes.size());
}

double Assembly::missed(const Pose& pose) {
  Joints joints = home_joints_;
  newton(pose, all_, whole_rank_, joints);
  const double missed = loops_.residual().norm();
  return std::isfinite(missed) ? -std::max(missed, kClosed) : -1;
}

std::vector<Pose> Assembly::around(const Pose& pose, const std::vector<int>& tangent) {
  std::vector<Pose> all{pose};
  const bool turns = tangent.front() > 2;  // a pose without a position
  for (const int coordinate : tangent) {
    if (turns == (coordinate > 2)) {
      Pose& there = all.emplace_back(pose);
      if (turns) {
        there.rotation = Eigen::AngleAxisd(kAside, Vector3d::Unit(coordinate - 3)) * pose.rotation;
      } else {
        there.position[coordinate] += kAside;
      }
    }
  }
  return all;
}

// The square of the slope falls with the distance from where it vanishes.
double Assembly::margin_of(const double* slopes, std::size_t count) {
  constexpr double kFlat = 1e-8;
  const double square = slopes[0] * slopes[0];
  double falls = 0;
  for (std::size_t i = 1; i < count; ++i) {
    const double by = (slopes[i] * slopes[i] - square) / kAside;
    falls += by * by;
  }
  falls = std::sqrt(falls);
  return falls > kFlat * square ? square / falls : std::numeric_limits<double>::infinity();
}

const Columns& Assembly::reciprocal() {
  if (known_here_) {
    return reciprocal_;
  }
  columns_ = loops_.columns();
  const PivotedQr qr(columns_, passive_, passive_rank_);
  reciprocal_ = qr.complement();
  // On one side of the passive columns, so that derivatives of all closures by the pose change the
  // sign of their determinant where they are singular alone.
  double side = orientation(qr);
  if (closures_ > 1 && !read_.empty()) {
    // A reflection carries the work with the reading into the first closure.
    Equations work = reciprocal_.transpose() * columns_.col(read_.front());
    const double size = work.norm();
    if (size > 0) {
      work[0] -= size;
      const double square = work.squaredNorm();
      if (square > 0) {
        const Equations along = reciprocal_ * work;
        reciprocal_ -= (2 / square) * along * work.transpose();
        side = -side;
      }
    }
  }
  if (side < 0) {
    reciprocal_.rightCols<1>() *= -1;
  }
  known_here_ = true;
  return reciprocal_;
}

}  // namespace symkin::declared
