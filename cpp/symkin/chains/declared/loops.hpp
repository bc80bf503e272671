// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "symkin/chains/declared/lane_leg.hpp"

namespace symkin::declared {

// Small matrices in place.
using Equations = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostEquations, 1>;
using Joints = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostJoints, 1>;
using Columns =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostEquations, kMostJoints>;
using Wrench = Eigen::Matrix<double, 6, 1>;

struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// A fixed transform, with the axes along or about which its numbers move what follows, in the frame
// before it.
struct TransformGeometry {
  explicit TransformGeometry(const TransformValues& values);

  Eigen::Matrix3d rotation;
  bool turns;  // whether that is any
  Eigen::Vector3d translation;
  Eigen::Matrix<double, 3, kSlots> axes;
};

// How many numbers must agree.
int equation_count(Compares compares);

// Work of a wrench: what a closure gains by each number.
struct Work {
  Wrench pose;                  // platform's origin in base axes, then its rotation vector
  Joints joints;                // that stand by themselves
  std::vector<double> scalars;  // in the description's order
};

// The loops of a leg at a pose and at joint values: what they miss, twists of the joints, and the
// work of wrenches. Frames are walked once; screws do the rest. Where a loop is not closed the
// derivatives are exact too.
class Loops {
 public:
  // Keeps the description. Throws InvalidInput where it is too large.
  explicit Loops(const Description& leg);

  // Other numbers than those drawn, in the description's order.
  void set_scalars(ConstVector scalars);
  int equations() const { return equations_; }
  const std::vector<int>& own() const { return own_; }

  // At values of the joints that stand by themselves. Steps before the first joint are walked once
  // a pose.
  void walk(const Pose& pose, const Joints& own_values) {
    stand(pose);
    walk(own_values);
  }
  void stand(const Pose& pose);
  void walk(const Joints& own_values);  // at the last pose

  // In base axes: left end less right end, and half the skew part of R_left R_right'.
  Equations residual() const;
  Columns columns() const;  // dresidual/djoint, equations x own joints
  void work(const Equations& closure, Work& work) const;
  // For the kernels, which read it as long as these loops and `transforms` live: all but the joints
  // and what is asked of them.
  LaneLeg lane_leg(std::vector<LaneTransform>& transforms) const;
  // Which equations each joint changes at most, a bit each.
  std::vector<unsigned> reach() const;
  // Whether every rotation that must agree is far from half a turn off, where residuals vanish too.
  bool on_this_side_of_half_a_turn() const;
  // Where the joints along the left path of the first loop stand, then the end of the right one,
  // or of the first that has a joint there; of a leg that turns about a centre, where their axes
  // and the end's z leave the unit sphere.
  std::vector<Eigen::Vector3d> places(bool on_sphere, int with_joint = -1) const;

 private:
  struct Frame {  // before a step
    Eigen::Matrix3d rotation;
    Eigen::Vector3d start, axis;
  };
  struct Path {
    std::vector<Frame> frames;  // one more than steps
    // The first step that depends on the pose, and the first behind it that does on joints.
    std::size_t fixed = 0, posed = 0;

    const Eigen::Matrix3d& rotation() const { return frames.back().rotation; }
    const Eigen::Vector3d& end() const { return frames.back().start; }
  };
  struct Walked {
    Path left, right;
    Eigen::Matrix3d between = Eigen::Matrix3d::Identity();  // of the ends' rotations, if compared
    double trace = 3;                                       // of that
    Eigen::Vector3d apart;  // of the points, of length one, of a distance

    // From a spin at the end of a path to the residual, and from what that does back.
    Eigen::Vector3d turned(const Eigen::Vector3d& spin, bool is_left) const;
    Eigen::Vector3d moment(const Eigen::Vector3d& of_residual, bool is_left) const;
  };

  // What does not depend on numbers, as the kernels take it.
  struct Form {
    std::vector<std::vector<Part>> of_transforms, of_ratios;
    std::vector<LaneJoint> joints;
    std::vector<LaneLoop> loops;
    std::vector<std::vector<int>> frames;  // of each path, the left and the right of each loop
    int frame_count = 0;
  };

  std::shared_ptr<const Form> form() const;
  LanePath lane_path(const std::vector<Step>& steps, const Path& path, Form& made) const;
  void set_transforms(const std::vector<TransformValues>& values);
  void prepare(const std::vector<Step>& steps, Path& path) const;
  void walk(const std::vector<Step>& steps, const Pose& pose, std::size_t first, std::size_t last,
            Path& path) const;
  void work_of_path(const std::vector<Step>& steps, const Path& path, const Eigen::Vector3d& force,
                    const Eigen::Vector3d& moment, Work& work) const;

  const Description* leg_;
  std::vector<int> own_, column_;  // the joints by themselves; of each joint whose column it moves
  std::vector<int> axes_;          // of each joint, of its own frame, or -1
  std::shared_ptr<const Form> form_;
  int equations_ = 0;
  std::vector<TransformGeometry> transforms_;
  std::vector<double> lengths_;  // of each transform its x
  std::vector<double> ratios_;   // of all joints, to what they follow
  std::vector<double> followed_, values_;
  std::vector<Walked> walked_;
  Pose pose_;
};

}  // namespace symkin::declared
