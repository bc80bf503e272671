// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/loops.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "symkin/model/pose_space.hpp"
#include "symkin/support/error.hpp"

namespace symkin::declared {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// By Rodrigues; Eigen's own takes a quaternion's way.
Matrix3d turn_about(const Vector3d& axis, double angle) {
  const double cosine = std::cos(angle);
  const Vector3d s = std::sin(angle) * axis;
  const Vector3d c = (1 - cosine) * axis;
  Matrix3d turn;
  turn << cosine + c.x() * axis.x(), c.x() * axis.y() - s.z(), c.x() * axis.z() + s.y(),
      c.x() * axis.y() + s.z(), cosine + c.y() * axis.y(), c.y() * axis.z() - s.x(),
      c.x() * axis.z() - s.y(), c.y() * axis.z() + s.x(), cosine + c.z() * axis.z();
  return turn;
}

// Which axis of its own frame a joint moves along or about, or -1 where it is none.
int own_axis(const Vector3d& axis) {
  for (int k = 0; k < 3; ++k) {
    if (axis[k] == 1) {
      return k;
    }
  }
  return -1;
}

// What a turn about an axis of its own frame makes of a rotation: it mixes two of its columns.
template <int kAlong>
void turn(Matrix3d& rotation, double angle) {
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  auto first = rotation.col((kAlong + 1) % 3);
  auto second = rotation.col((kAlong + 2) % 3);
  const Vector3d before = first;
  first = cosine * before + sine * second;
  second = cosine * second - sine * before;
}

bool compares_rotation(Compares compares) {
  return compares == Compares::pose || compares == Compares::rotation ||
         compares == Compares::planar_pose;
}

// The numbers of position and rotation that a loop compares, added to rows of the residual, and
// back.
void add(Compares compares, const Vector3d& position, const Vector3d& rotation, double* rows) {
  const bool planar = compares == Compares::planar_pose || compares == Compares::planar_point;
  if (compares != Compares::rotation) {
    rows[0] += position.x();
    rows[1] += position.y();
    rows += 2;
    if (!planar) {
      *rows++ += position.z();
    }
  }
  if (compares == Compares::planar_pose) {
    *rows += rotation.z();
  } else if (compares_rotation(compares)) {
    Eigen::Map<Vector3d>{rows} += rotation;
  }
}

struct Pair {
  Vector3d position, rotation;
};

Pair taken(Compares compares, const double* rows) {
  const Vector3d zero = Vector3d::Zero();
  switch (compares) {
    case Compares::pose:
      return {Eigen::Map<const Vector3d>(rows), Eigen::Map<const Vector3d>(rows + 3)};
    case Compares::point:
      return {Eigen::Map<const Vector3d>(rows), zero};
    case Compares::rotation:
      return {zero, Eigen::Map<const Vector3d>(rows)};
    case Compares::planar_pose:
      return {{rows[0], rows[1], 0}, {0, 0, rows[2]}};
    case Compares::planar_point:
      return {{rows[0], rows[1], 0}, zero};
    case Compares::distance:
      break;
  }
  return {zero, zero};
}

Parts parts_of(const std::vector<Part>& all) { return {all.data(), static_cast<int>(all.size())}; }

bool moves_along(Slot slot) { return slot == Slot::x || slot == Slot::y || slot == Slot::z; }

}  // namespace

int equation_count(Compares compares) {
  switch (compares) {
    case Compares::pose:
      return 6;
    case Compares::planar_point:
      return 2;
    case Compares::distance:
      return 1;
    default:
      return 3;
  }
}

TransformGeometry::TransformGeometry(const TransformValues& values) {
  const auto value = [&](Slot slot) { return values[static_cast<std::size_t>(slot)]; };
  const auto axis = [&](Slot slot) { return axes.col(static_cast<int>(slot)); };
  const Vector3d ux = Vector3d::UnitX();
  const Vector3d uy = Vector3d::UnitY();
  const Vector3d uz = Vector3d::UnitZ();
  const Matrix3d first = turn_about(uz, value(Slot::azimuth));
  translation = first * Vector3d(value(Slot::x), value(Slot::y), value(Slot::z));
  axes.leftCols<4>() << uz, first;
  const Matrix3d yawed = first * turn_about(uz, value(Slot::yaw));
  const Matrix3d pitched = yawed * turn_about(uy, value(Slot::pitch));
  axis(Slot::yaw) = first * uz;
  axis(Slot::pitch) = yawed * uy;
  axis(Slot::roll) = pitched * ux;
  const Vector3d small(value(Slot::rx), value(Slot::ry), value(Slot::rz));
  const Matrix3d turned = pitched * turn_about(ux, value(Slot::roll));
  axes.rightCols<3>() = turned * left_jacobian(small);
  const double angle = small.norm();
  rotation = angle > 0 ? Matrix3d(turned * turn_about(small / angle, angle)) : turned;
  turns = rotation != Matrix3d::Identity();
}

Loops::Loops(const Description& leg) : leg_(&leg), own_(own_joints(leg)) {
  column_.assign(leg.joints.size(), -1);
  for (std::size_t i = 0; i < own_.size(); ++i) {
    column_[static_cast<std::size_t>(own_[i])] = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < leg.joints.size(); ++i) {
    if (leg.joints[i].follows >= 0) {
      column_[i] = column_[static_cast<std::size_t>(leg.joints[i].follows)];
    }
  }
  for (const Loop& loop : leg.loops) {
    equations_ += equation_count(loop.compares);
  }
  if (equations_ > kMostEquations || static_cast<int>(own_.size()) > kMostJoints) {
    throw InvalidInput("a declared leg has " + std::to_string(equations_) + " equations and " +
                       std::to_string(own_.size()) + " joints; expected at most " +
                       std::to_string(kMostEquations) + " and " + std::to_string(kMostJoints));
  }
  for (const Joint& joint : leg.joints) {
    ratios_.push_back(joint.follows == Joint::kOwn ? 1 : joint.ratio);
    axes_.push_back(own_axis(joint.axis));
  }
  followed_.resize(leg.joints.size());
  values_.resize(leg.joints.size());
  walked_.resize(leg.loops.size());
  for (std::size_t i = 0; i < leg.loops.size(); ++i) {
    prepare(leg.loops[i].left, walked_[i].left);
    prepare(leg.loops[i].right, walked_[i].right);
  }
  form_ = form();
  set_transforms(leg.transforms);
}

std::shared_ptr<const Loops::Form> Loops::form() const {
  auto made = std::make_shared<Form>();
  made->of_transforms.resize(leg_->transforms.size());
  made->of_ratios.resize(leg_->joints.size());
  for (std::size_t i = 0; i < leg_->scalars.size(); ++i) {
    const Scalar& scalar = leg_->scalars[i];
    const int number = static_cast<int>(i);
    made->of_transforms[static_cast<std::size_t>(scalar.transform)].push_back(
        {scalar.slot, number, 1});
    for (const Use& use : scalar.uses) {
      auto& parts = use.at.kind == Step::Kind::joint ? made->of_ratios : made->of_transforms;
      parts[static_cast<std::size_t>(use.at.index)].push_back({use.slot, number, use.factor});
    }
  }
  for (std::size_t i = 0; i < leg_->joints.size(); ++i) {
    const Joint& joint = leg_->joints[i];
    made->joints.push_back({joint.kind,
                            axes_[i],
                            {joint.axis.x(), joint.axis.y(), joint.axis.z()},
                            column_[i],
                            joint.follows == Joint::kOwn,
                            joint.offset,
                            parts_of(made->of_ratios[i])});
  }
  for (std::size_t i = 0; i < leg_->loops.size(); ++i) {
    const Loop& loop = leg_->loops[i];
    const LanePath left = lane_path(loop.left, walked_[i].left, *made);
    const LanePath right = lane_path(loop.right, walked_[i].right, *made);
    made->loops.push_back({left, right, loop.compares, loop.length_transform, loop.length_joint});
  }
  return made;
}

LanePath Loops::lane_path(const std::vector<Step>& steps, const Path& path, Form& made) const {
  const auto same = [](const Step& a, const Step& b) {
    return a.kind == b.kind && a.index == b.index;
  };
  std::size_t shared = 0;
  const std::vector<int>* with = nullptr;
  for (std::size_t i = 0; i < made.frames.size(); ++i) {
    const Loop& loop = leg_->loops[i / 2];
    const std::vector<Step>& others = i % 2 == 0 ? loop.left : loop.right;
    const auto end = std::mismatch(steps.begin(), steps.end(), others.begin(), others.end(), same);
    const auto count = static_cast<std::size_t>(end.first - steps.begin());
    if (count > shared) {
      shared = count;
      with = &made.frames[i];
    }
  }
  // Where it leaves, a frame's axis is its own.
  const std::size_t taken = shared < steps.size() ? shared : shared + 1;
  std::vector<int> frames;
  for (std::size_t i = 0; i <= steps.size(); ++i) {
    frames.push_back(with != nullptr && i < taken ? (*with)[i] : made.frame_count++);
  }
  const int leaves = with == nullptr ? -1 : (*with)[shared];
  made.frames.push_back(std::move(frames));
  return {steps.data(),
          static_cast<int>(steps.size()),
          static_cast<int>(path.fixed),
          static_cast<int>(path.posed),
          made.frames.back().data(),
          static_cast<int>(shared),
          leaves};
}

std::vector<unsigned> Loops::reach() const {
  std::vector<unsigned> all(own_.size(), 0);
  int row = 0;
  for (const Loop& loop : leg_->loops) {
    const int count = equation_count(loop.compares);
    const unsigned rows = ((1U << count) - 1) << row;
    for (const std::vector<Step>* const steps : {&loop.left, &loop.right}) {
      for (const Step& step : *steps) {
        const int column =
            step.kind == Step::Kind::joint ? column_[static_cast<std::size_t>(step.index)] : -1;
        if (column >= 0) {
          all[static_cast<std::size_t>(column)] |= rows;
        }
      }
    }
    if (loop.length_joint >= 0) {
      all[static_cast<std::size_t>(column_[static_cast<std::size_t>(loop.length_joint)])] |= rows;
    }
    row += count;
  }
  return all;
}

LaneLeg Loops::lane_leg(std::vector<LaneTransform>& transforms) const {
  transforms.resize(transforms_.size());
  for (std::size_t i = 0; i < transforms.size(); ++i) {
    const TransformGeometry& from = transforms_[i];
    LaneTransform& to = transforms[i];
    std::copy_n(from.rotation.data(), from.rotation.size(), to.rotation);
    std::copy_n(from.translation.data(), from.translation.size(), to.translation);
    std::copy_n(from.axes.data(), from.axes.size(), to.axes);
    to.length = lengths_[i];
    to.turns = from.turns;
    to.parts = parts_of(form_->of_transforms[i]);
  }
  LaneLeg leg{};
  leg.loops = form_->loops.data();
  leg.loop_count = static_cast<int>(form_->loops.size());
  leg.joints = form_->joints.data();
  leg.ratios = ratios_.data();
  leg.joint_count = static_cast<int>(form_->joints.size());
  leg.transforms = transforms.data();
  leg.frame_count = form_->frame_count;
  leg.scalar_count = static_cast<int>(leg_->scalars.size());
  leg.equations = equations_;
  leg.own_count = static_cast<int>(own_.size());
  return leg;
}

void Loops::set_scalars(ConstVector scalars) {
  std::vector<TransformValues> values = leg_->transforms;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (const Part& part : form_->of_transforms[i]) {
      values[i][static_cast<std::size_t>(part.slot)] = part.factor * scalars[part.scalar];
    }
  }
  set_transforms(values);
  for (std::size_t i = 0; i < ratios_.size(); ++i) {
    for (const Part& part : form_->of_ratios[i]) {
      ratios_[i] = part.factor * scalars[part.scalar];
    }
  }
}

void Loops::set_transforms(const std::vector<TransformValues>& values) {
  transforms_.clear();
  lengths_.clear();
  for (const TransformValues& each : values) {
    transforms_.emplace_back(each);
    lengths_.push_back(each[static_cast<std::size_t>(Slot::x)]);
  }
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    Walked& walked = walked_[i];
    walk(leg_->loops[i].left, pose_, 0, walked.left.fixed, walked.left);
    walk(leg_->loops[i].right, pose_, 0, walked.right.fixed, walked.right);
  }
}

void Loops::prepare(const std::vector<Step>& steps, Path& path) const {
  path.frames.resize(steps.size() + 1);
  path.frames.front().rotation.setIdentity();
  path.frames.front().start.setZero();
  path.posed = steps.size();
  for (std::size_t i = steps.size(); i-- > 0;) {
    if (steps[i].kind == Step::Kind::joint &&
        leg_->joints[static_cast<std::size_t>(steps[i].index)].follows != Joint::kPoseYaw) {
      path.posed = i;
    }
  }
  path.fixed = path.posed;
  for (std::size_t i = path.posed; i-- > 0;) {
    if (steps[i].kind != Step::Kind::transform) {
      path.fixed = i;
    }
  }
}

void Loops::walk(const std::vector<Step>& steps, const Pose& pose, std::size_t first,
                 std::size_t last, Path& path) const {
  Matrix3d rotation = path.frames[first].rotation;
  Vector3d end = path.frames[first].start;
  for (std::size_t i = first; i < last; ++i) {
    const auto index = static_cast<std::size_t>(steps[i].index);
    switch (steps[i].kind) {
      case Step::Kind::transform:
        end += rotation * transforms_[index].translation;
        if (transforms_[index].turns) {
          rotation = rotation * transforms_[index].rotation;
        }
        break;
      case Step::Kind::pose:
        end += rotation * pose.position;
        rotation = rotation * pose.rotation;
        break;
      case Step::Kind::joint: {
        const Joint& joint = leg_->joints[index];
        const int along = axes_[index];
        Vector3d& axis = path.frames[i].axis;
        axis = along < 0 ? Vector3d(rotation * joint.axis) : Vector3d(rotation.col(along));
        if (joint.kind == JointKind::slide) {
          end += values_[index] * axis;
        } else if (along == 0) {
          turn<0>(rotation, values_[index]);
        } else if (along == 1) {
          turn<1>(rotation, values_[index]);
        } else if (along == 2) {
          turn<2>(rotation, values_[index]);
        } else {
          rotation = rotation * turn_about(joint.axis, values_[index]);
        }
        break;
      }
    }
    path.frames[i + 1].rotation = rotation;
    path.frames[i + 1].start = end;
  }
}

void Loops::stand(const Pose& pose) {
  pose_ = pose;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const Joint& joint = leg_->joints[i];
    if (joint.follows == Joint::kPoseYaw) {
      followed_[i] = std::atan2(pose.rotation(1, 0), pose.rotation(0, 0));
      values_[i] = ratios_[i] * followed_[i] + joint.offset;
    }
  }
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    const Loop& loop = leg_->loops[i];
    Walked& walked = walked_[i];
    walk(loop.left, pose, walked.left.fixed, walked.left.posed, walked.left);
    walk(loop.right, pose, walked.right.fixed, walked.right.posed, walked.right);
  }
}

void Loops::walk(const Joints& own_values) {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const Joint& joint = leg_->joints[i];
    if (joint.follows != Joint::kPoseYaw) {
      followed_[i] = own_values[column_[i]];
      values_[i] =
          joint.follows == Joint::kOwn ? followed_[i] : ratios_[i] * followed_[i] + joint.offset;
    }
  }
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    const Loop& loop = leg_->loops[i];
    Walked& walked = walked_[i];
    walk(loop.left, pose_, walked.left.posed, loop.left.size(), walked.left);
    walk(loop.right, pose_, walked.right.posed, loop.right.size(), walked.right);
    if (compares_rotation(loop.compares)) {
      walked.between = walked.left.rotation() * walked.right.rotation().transpose();
      walked.trace = walked.between.trace();
    }
    if (loop.compares == Compares::distance) {
      walked.apart = (walked.left.end() - walked.right.end()).normalized();
    }
  }
}

Vector3d Loops::Walked::turned(const Vector3d& spin, bool is_left) const {
  const Vector3d seen = is_left ? spin : Vector3d(between * spin);
  return (trace * seen - between * seen) / 2;
}

Vector3d Loops::Walked::moment(const Vector3d& of_residual, bool is_left) const {
  const Vector3d seen = (trace * of_residual - between.transpose() * of_residual) / 2;
  return is_left ? seen : Vector3d(between.transpose() * seen);
}

Equations Loops::residual() const {
  Equations all = Equations::Zero(equations_);
  int row = 0;
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    const Walked& walked = walked_[i];
    const Loop& loop = leg_->loops[i];
    const Vector3d apart = walked.left.end() - walked.right.end();
    if (loop.compares == Compares::distance) {
      all[row++] = apart.norm() - (loop.length_joint >= 0
                                       ? values_[static_cast<std::size_t>(loop.length_joint)]
                                       : lengths_[static_cast<std::size_t>(loop.length_transform)]);
      continue;
    }
    const Matrix3d& between = walked.between;
    const Vector3d skew = Vector3d(between(2, 1) - between(1, 2), between(0, 2) - between(2, 0),
                                   between(1, 0) - between(0, 1)) /
                          2;
    add(loop.compares, apart, skew, &all[row]);
    row += equation_count(loop.compares);
  }
  return all;
}

Columns Loops::columns() const {
  Columns all = Columns::Zero(equations_, static_cast<Index>(own_.size()));
  int row = 0;
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    const Walked& walked = walked_[i];
    const Loop& loop = leg_->loops[i];
    const bool turns = compares_rotation(loop.compares);
    for (const bool left : {true, false}) {
      const Path& path = left ? walked.left : walked.right;
      const std::vector<Step>& steps = left ? loop.left : loop.right;
      for (std::size_t k = 0; k < steps.size(); ++k) {
        const auto index = static_cast<std::size_t>(steps[k].index);
        if (steps[k].kind != Step::Kind::joint || column_[index] < 0) {
          continue;
        }
        const Joint& joint = leg_->joints[index];
        const Frame& frame = path.frames[k];
        const bool slides = joint.kind == JointKind::slide;
        const Vector3d move = slides ? frame.axis : frame.axis.cross(path.end() - frame.start);
        const double ratio = left ? ratios_[index] : -ratios_[index];
        double* const rows = &all(row, column_[index]);
        if (loop.compares == Compares::distance) {
          *rows += ratio * walked.apart.dot(move);
          continue;
        }
        const Vector3d spin =
            slides || !turns ? Vector3d(Vector3d::Zero()) : walked.turned(frame.axis, left);
        add(loop.compares, ratio * move, ratio * spin, rows);
      }
    }
    if (loop.length_joint >= 0) {
      all(row, column_[static_cast<std::size_t>(loop.length_joint)]) -= 1;
    }
    row += equation_count(loop.compares);
  }
  return all;
}

void Loops::work(const Equations& closure, Work& work) const {
  work.pose.setZero();
  work.joints = Joints::Zero(static_cast<Index>(own_.size()));
  work.scalars.assign(leg_->scalars.size(), 0);
  int row = 0;
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    const Walked& walked = walked_[i];
    const Loop& loop = leg_->loops[i];
    auto [force, moment] = taken(loop.compares, closure.data() + row);
    if (loop.compares == Compares::distance) {
      force = closure[row] * walked.apart;
      if (loop.length_joint >= 0) {
        work.joints[column_[static_cast<std::size_t>(loop.length_joint)]] -= closure[row];
      } else {
        for (const Part& part :
             form_->of_transforms[static_cast<std::size_t>(loop.length_transform)]) {
          work.scalars[static_cast<std::size_t>(part.scalar)] -= part.factor * closure[row];
        }
      }
    }
    const bool turns = compares_rotation(loop.compares);
    const Vector3d on_left = turns ? walked.moment(moment, true) : moment;
    const Vector3d on_right = turns ? walked.moment(moment, false) : moment;
    work_of_path(loop.left, walked.left, force, on_left, work);
    work_of_path(loop.right, walked.right, -force, -on_right, work);
    row += equation_count(loop.compares);
  }
}

void Loops::work_of_path(const std::vector<Step>& steps, const Path& path, const Vector3d& force,
                         const Vector3d& moment, Work& work) const {
  const auto moment_at = [&](const Vector3d& point) -> Vector3d {
    return moment + (path.end() - point).cross(force);
  };
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const Frame& frame = path.frames[k];
    const auto index = static_cast<std::size_t>(steps[k].index);
    if (steps[k].kind == Step::Kind::joint) {
      const Joint& joint = leg_->joints[index];
      const double by_joint = joint.kind == JointKind::slide
                                  ? frame.axis.dot(force)
                                  : frame.axis.dot(moment_at(frame.start));
      double& moves = joint.follows == Joint::kPoseYaw ? work.pose[5] : work.joints[column_[index]];
      moves += ratios_[index] * by_joint;
      for (const Part& part : form_->of_ratios[index]) {
        work.scalars[static_cast<std::size_t>(part.scalar)] +=
            part.factor * followed_[index] * by_joint;
      }
      continue;
    }
    if (steps[k].kind == Step::Kind::transform && form_->of_transforms[index].empty()) {
      continue;
    }
    const Vector3d local_force = frame.rotation.transpose() * force;
    const Vector3d at_end = frame.rotation.transpose() * moment_at(path.frames[k + 1].start);
    if (steps[k].kind == Step::Kind::pose) {
      work.pose.head<3>() += local_force;
      work.pose.tail<3>() += at_end;
      continue;
    }
    const TransformGeometry& transform = transforms_[index];
    for (const Part& part : form_->of_transforms[index]) {
      const Vector3d& does = moves_along(part.slot) ? local_force : at_end;
      double gained = transform.axes.col(static_cast<int>(part.slot)).dot(does);
      if (part.slot == Slot::azimuth) {
        gained = (frame.rotation.transpose() * moment_at(frame.start)).z();
      }
      work.scalars[static_cast<std::size_t>(part.scalar)] += part.factor * gained;
    }
  }
}

bool Loops::on_this_side_of_half_a_turn() const {
  constexpr double kAgrees = 2.9;  // trace of the rotation between both ends
  for (std::size_t i = 0; i < walked_.size(); ++i) {
    if (compares_rotation(leg_->loops[i].compares) && walked_[i].trace < kAgrees) {
      return false;
    }
  }
  return true;
}

std::vector<Vector3d> Loops::places(bool on_sphere, int with_joint) const {
  std::vector<Vector3d> all;
  const auto has_it = [&](const Loop& loop) {
    return std::any_of(loop.left.begin(), loop.left.end(), [&](const Step& step) {
      return step.kind == Step::Kind::joint && step.index == with_joint;
    });
  };
  const auto found = std::find_if(leg_->loops.begin(), leg_->loops.end(), has_it);
  const Loop& loop = found == leg_->loops.end() ? leg_->loops.front() : *found;
  const Walked& walked = walked_[static_cast<std::size_t>(&loop - leg_->loops.data())];
  for (std::size_t k = 0; k < loop.left.size(); ++k) {
    if (loop.left[k].kind == Step::Kind::joint) {
      const Frame& frame = walked.left.frames[k];
      all.push_back(on_sphere ? frame.axis : frame.start);
    }
  }
  if (loop.compares == Compares::distance) {
    all.push_back(walked.left.end());
  }
  all.push_back(on_sphere ? Vector3d(walked.right.rotation().col(2)) : walked.right.end());
  return all;
}

}  // namespace symkin::declared
