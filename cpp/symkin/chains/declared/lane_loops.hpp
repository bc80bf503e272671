// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "symkin/chains/declared/lane_leg.hpp"
#include "symkin/chains/spatial.hpp"
#include "symkin/model/batched_leg.hpp"

namespace symkin::declared {

// As Loops, of several poses side by side, a lane each.
template <typename T>
class LaneLoops {
  using V = Vec3<T>;

 public:
  using Mask = typename Lanes<T>::Mask;

  explicit LaneLoops(const LaneLeg& leg)
      : leg_(leg),
        frames_(static_cast<std::size_t>(leg.frame_count)),
        ends_(static_cast<std::size_t>(leg.loop_count)),
        followed_(static_cast<std::size_t>(leg.joint_count)),
        values_(static_cast<std::size_t>(leg.joint_count)) {
    each_path([&](const LanePath& path) {
      at(path, 0).rotation = {
          {T(1.0), T(0.0), T(0.0)}, {T(0.0), T(1.0), T(0.0)}, {T(0.0), T(0.0), T(1.0)}};
      at(path, 0).start = {T(0.0), T(0.0), T(0.0)};
      walk(path, 0, path.fixed);
    });
  }

  // At poses; the steps before the first joint are walked.
  void stand(const detail::LaneRows<T>& rows, const double* poses) {
    const auto number = [&](int i) { return rows.read(poses + i, kPoseNumbers); };
    pose_.rotation = {{number(0), number(1), number(2)},
                      {number(3), number(4), number(5)},
                      {number(6), number(7), number(8)}};
    pose_.start = {number(9), number(10), number(11)};
    for (int i = 0; i < leg_.joint_count; ++i) {
      if (leg_.joints[i].column < 0) {
        follow(i, number(12));
      }
    }
    each_path([&](const LanePath& path) { walk(path, path.fixed, path.posed); });
  }

  // At the last poses, at values of the joints that stand by themselves.
  void walk(const T* own) {
    for (int i = 0; i < leg_.joint_count; ++i) {
      if (leg_.joints[i].column >= 0) {
        follow(i, own[leg_.joints[i].column]);
      }
    }
    for (int i = 0; i < leg_.loop_count; ++i) {
      const LaneLoop& loop = leg_.loops[i];
      walk(loop.left, loop.left.posed, loop.left.count);
      walk(loop.right, loop.right.posed, loop.right.count);
      Ends& ends = ends_[static_cast<std::size_t>(i)];
      const Frame& left = at(loop.left, loop.left.count);
      const Frame& right = at(loop.right, loop.right.count);
      ends.apart = left.start - right.start;
      if (loop.compares == Compares::distance) {
        ends.distance = norm(ends.apart);
        ends.apart = (T(1.0) / ends.distance) * ends.apart;
      }
      if (compares_rotation(loop.compares)) {
        ends.between = times_transposed(left.rotation, right.rotation);
        ends.trace = ends.between.x.x + ends.between.y.y + ends.between.z.z;
      }
    }
  }

  void residual(T* all) const {
    zero(all, leg_.equations);
    for (int i = 0; i < leg_.loop_count; ++i) {
      const LaneLoop& loop = leg_.loops[i];
      const Ends& ends = ends_[static_cast<std::size_t>(i)];
      if (loop.compares == Compares::distance) {
        *all++ = ends.distance - (loop.length_joint >= 0
                                      ? values_[static_cast<std::size_t>(loop.length_joint)]
                                      : T(leg_.transforms[loop.length_transform].length));
        continue;
      }
      const Rotation& between = ends.between;
      const V skew = T(0.5) * V{between.y.z - between.z.y, between.z.x - between.x.z,
                                between.x.y - between.y.x};
      all = add(loop.compares, ends.apart, skew, all);
    }
  }

  // Of each joint by itself the derivatives of the residual.
  template <int kMost>
  void columns(T (*all)[kMost]) const {
    for (int i = 0; i < leg_.own_count; ++i) {
      zero(all[i], leg_.equations);
    }
    int row = 0;
    for (int i = 0; i < leg_.loop_count; ++i) {
      const LaneLoop& loop = leg_.loops[i];
      const Ends& ends = ends_[static_cast<std::size_t>(i)];
      for (const bool left : {true, false}) {
        const LanePath& path = left ? loop.left : loop.right;
        const V& end = at(path, path.count).start;
        for (int k = path.posed; k < path.count; ++k) {
          const int index = path.steps[k].index;
          if (path.steps[k].kind != Step::Kind::joint || leg_.joints[index].column < 0) {
            continue;
          }
          const bool slides = leg_.joints[index].kind == JointKind::slide;
          const Frame& frame = at(path, k);
          const V move = slides ? frame.axis : cross(frame.axis, end - frame.start);
          const T ratio(left ? leg_.ratios[index] : -leg_.ratios[index]);
          T* const rows = all[leg_.joints[index].column] + row;
          if (loop.compares == Compares::distance) {
            *rows = *rows + ratio * dot(ends.apart, move);
            continue;
          }
          V spin{T(0.0), T(0.0), T(0.0)};
          if (!slides && compares_rotation(loop.compares)) {
            spin = ratio * ends.turned(frame.axis, left);
          }
          add(loop.compares, ratio * move, spin, rows);
        }
      }
      if (loop.length_joint >= 0) {
        T& of_length = all[leg_.joints[loop.length_joint].column][row];
        of_length = of_length - T(1.0);
      }
      row += count_of(loop.compares);
    }
  }

  // What a closure gains by each number: the pose's six, the joints by themselves, the scalars.
  void work(const T* closure, T* pose, T* joints, T* scalars) const {
    zero(pose, 6);
    zero(joints, leg_.own_count);
    zero(scalars, leg_.scalar_count);
    const T* rows = closure;
    for (int i = 0; i < leg_.loop_count; ++i) {
      const LaneLoop& loop = leg_.loops[i];
      const Ends& ends = ends_[static_cast<std::size_t>(i)];
      const V none{T(0.0), T(0.0), T(0.0)};
      V force = none, on_left = none, on_right = none;
      if (loop.compares == Compares::distance) {
        force = *rows * ends.apart;
        if (loop.length_joint >= 0) {
          T& of_length = joints[leg_.joints[loop.length_joint].column];
          of_length = of_length - *rows;
        } else {
          gain(leg_.transforms[loop.length_transform].parts, -*rows, scalars);
        }
      } else {
        V moment = none;
        taken(loop.compares, rows, force, moment);
        if (compares_rotation(loop.compares)) {
          on_left = ends.moment(moment, true);
          on_right = ends.moment(moment, false);
        }
      }
      work_of_path(loop.left, force, on_left, pose, joints, scalars);
      work_of_path(loop.right, T(-1.0) * force, T(-1.0) * on_right, pose, joints, scalars);
      rows += count_of(loop.compares);
    }
  }

  Mask on_this_side_of_half_a_turn() const {
    const T agrees(2.9);  // trace of the rotation between both ends
    Mask all = agrees > T(0.0);
    for (int i = 0; i < leg_.loop_count; ++i) {
      if (compares_rotation(leg_.loops[i].compares)) {
        all = all & (ends_[static_cast<std::size_t>(i)].trace > agrees);
      }
    }
    return all;
  }

 private:
  struct Rotation {  // by columns
    V x, y, z;
    V operator*(const V& v) const { return v.x * x + v.y * y + v.z * z; }
    V transposed(const V& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
  };
  struct Frame {  // before a step
    Rotation rotation;
    V start, axis;
  };
  struct Ends {
    Rotation between;  // of the ends' rotations, if compared
    T trace, distance;
    V apart;  // of the points, of length one, of a distance

    V turned(const V& spin, bool is_left) const {
      const V seen = is_left ? spin : between * spin;
      return T(0.5) * (trace * seen - between * seen);
    }
    V moment(const V& of_residual, bool is_left) const {
      const V seen = T(0.5) * (trace * of_residual - between.transposed(of_residual));
      return is_left ? seen : between.transposed(seen);
    }
  };

  static bool compares_rotation(Compares compares) {
    return compares == Compares::pose || compares == Compares::rotation ||
           compares == Compares::planar_pose;
  }
  static int count_of(Compares compares) {
    return compares == Compares::pose           ? 6
           : compares == Compares::planar_point ? 2
           : compares == Compares::distance     ? 1
                                                : 3;
  }
  static void zero(T* values, int count) {
    for (int i = 0; i < count; ++i) {
      values[i] = T(0.0);
    }
  }
  static Rotation times_transposed(const Rotation& a, const Rotation& b) {
    return {b.x.x * a.x + b.y.x * a.y + b.z.x * a.z, b.x.y * a.x + b.y.y * a.y + b.z.y * a.z,
            b.x.z * a.x + b.y.z * a.y + b.z.z * a.z};
  }

  // To rows of the residual; returns those behind.
  static T* add(Compares compares, const V& position, const V& rotation, T* rows) {
    const auto plus = [&rows](const T& value) {
      *rows = *rows + value;
      ++rows;
    };
    if (compares != Compares::rotation) {
      plus(position.x);
      plus(position.y);
      if (compares == Compares::pose || compares == Compares::point) {
        plus(position.z);
      }
    }
    if (compares == Compares::pose || compares == Compares::rotation) {
      plus(rotation.x);
      plus(rotation.y);
    }
    if (compares_rotation(compares)) {
      plus(rotation.z);
    }
    return rows;
  }

  static void taken(Compares compares, const T* rows, V& position, V& rotation) {
    if (compares != Compares::rotation) {
      position.x = *rows++;
      position.y = *rows++;
      if (compares == Compares::pose || compares == Compares::point) {
        position.z = *rows++;
      }
    }
    if (compares == Compares::pose || compares == Compares::rotation) {
      rotation.x = *rows++;
      rotation.y = *rows++;
    }
    if (compares_rotation(compares)) {
      rotation.z = *rows;
    }
  }

  static void gain(const Parts& parts, const T& by, T* scalars) {
    for (int i = 0; i < parts.count; ++i) {
      T& scalar = scalars[parts.first[i].scalar];
      scalar = scalar + T(parts.first[i].factor) * by;
    }
  }

  template <typename Visit>
  void each_path(const Visit& visit) const {
    for (int i = 0; i < leg_.loop_count; ++i) {
      visit(leg_.loops[i].left);
      visit(leg_.loops[i].right);
    }
  }

  Frame& at(const LanePath& path, int step) { return frames_.data()[path.frames[step]]; }
  const Frame& at(const LanePath& path, int step) const {
    return frames_.data()[path.frames[step]];
  }

  void follow(int joint, const T& followed) {
    const auto i = static_cast<std::size_t>(joint);
    followed_[i] = followed;
    values_[i] = leg_.joints[joint].own
                     ? followed
                     : T(leg_.ratios[joint]) * followed + T(leg_.joints[joint].offset);
  }

  // Two columns mixed.
  static void mix(V& first, V& second, const T& cosine, const T& sine) {
    const V before = first;
    first = cosine * before + sine * second;
    second = cosine * second - sine * before;
  }

  static void turn(const LaneJoint& joint, const V& axis, const T& angle, Rotation& rotation) {
    T cosine, sine;
    Lanes<T>::cosine_sine(angle, cosine, sine);
    if (joint.along == 0) {
      mix(rotation.y, rotation.z, cosine, sine);
    } else if (joint.along == 1) {
      mix(rotation.z, rotation.x, cosine, sine);
    } else if (joint.along == 2) {
      mix(rotation.x, rotation.y, cosine, sine);
    } else {
      for (V* const column : {&rotation.x, &rotation.y, &rotation.z}) {
        *column = about(axis, cosine, sine, *column);
      }
    }
  }

  // By Rodrigues.
  static V about(const V& axis, const T& cosine, const T& sine, const V& v) {
    return cosine * v + sine * cross(axis, v) + ((T(1.0) - cosine) * dot(axis, v)) * axis;
  }

  void walk(const LanePath& path, int first, int last) {
    first = std::max(first, path.shared);
    if (first >= last) {
      return;
    }
    if (first == path.shared && first > 0) {
      at(path, first) = frames_[static_cast<std::size_t>(path.leaves)];
    }
    Rotation rotation = at(path, first).rotation;
    V end = at(path, first).start;
    for (int i = first; i < last; ++i) {
      const int index = path.steps[i].index;
      switch (path.steps[i].kind) {
        case Step::Kind::transform: {
          const LaneTransform& transform = leg_.transforms[index];
          end = end + rotation * broadcast(transform.translation);
          if (transform.turns) {
            rotation = {rotation * broadcast(transform.rotation),
                        rotation * broadcast(transform.rotation + 3),
                        rotation * broadcast(transform.rotation + 6)};
          }
          break;
        }
        case Step::Kind::pose:
          end = end + rotation * pose_.start;
          rotation = {rotation * pose_.rotation.x, rotation * pose_.rotation.y,
                      rotation * pose_.rotation.z};
          break;
        case Step::Kind::joint: {
          const LaneJoint& joint = leg_.joints[index];
          const T& value = values_[static_cast<std::size_t>(index)];
          V& axis = at(path, i).axis;
          axis = joint.along == 0   ? rotation.x
                 : joint.along == 1 ? rotation.y
                 : joint.along == 2 ? rotation.z
                                    : rotation * broadcast(joint.axis);
          if (joint.kind == JointKind::slide) {
            end = end + value * axis;
          } else {
            turn(joint, axis, value, rotation);
          }
          break;
        }
      }
      Frame& next = at(path, i + 1);
      next.rotation = rotation;
      next.start = end;
    }
  }

  static V broadcast(const double* numbers) {
    return {T(numbers[0]), T(numbers[1]), T(numbers[2])};
  }

  void work_of_path(const LanePath& path, const V& force, const V& moment, T* pose, T* joints,
                    T* scalars) const {
    const V& end = at(path, path.count).start;
    const auto moment_at = [&](const V& point) { return moment + cross(end - point, force); };
    for (int k = 0; k < path.count; ++k) {
      const Frame& frame = at(path, k);
      const int index = path.steps[k].index;
      if (path.steps[k].kind == Step::Kind::joint) {
        const LaneJoint& joint = leg_.joints[index];
        const T by_joint = joint.kind == JointKind::slide ? dot(frame.axis, force)
                                                          : dot(frame.axis, moment_at(frame.start));
        T& moves = joint.column < 0 ? pose[5] : joints[joint.column];
        moves = moves + T(leg_.ratios[index]) * by_joint;
        if (joint.ratio.count > 0) {
          gain(joint.ratio, followed_[static_cast<std::size_t>(index)] * by_joint, scalars);
        }
        continue;
      }
      const bool is_pose = path.steps[k].kind == Step::Kind::pose;
      if (!is_pose && leg_.transforms[index].parts.count == 0) {
        continue;
      }
      const V local_force = frame.rotation.transposed(force);
      const V at_end = frame.rotation.transposed(moment_at(at(path, k + 1).start));
      if (is_pose) {
        add(Compares::pose, local_force, at_end, pose);
        continue;
      }
      const LaneTransform& transform = leg_.transforms[index];
      for (int i = 0; i < transform.parts.count; ++i) {
        const Part& part = transform.parts.first[i];
        T gained(0.0);
        if (part.slot == Slot::azimuth) {
          gained = dot(frame.rotation.z, moment_at(frame.start));
        } else {
          const bool along = part.slot == Slot::x || part.slot == Slot::y || part.slot == Slot::z;
          gained = dot(broadcast(transform.axes + 3 * static_cast<int>(part.slot)),
                       along ? local_force : at_end);
        }
        scalars[part.scalar] = scalars[part.scalar] + T(part.factor) * gained;
      }
    }
  }

  const LaneLeg& leg_;
  std::vector<Frame> frames_;
  std::vector<Ends> ends_;
  std::vector<T> followed_, values_;
  Frame pose_;
};

}  // namespace symkin::declared
