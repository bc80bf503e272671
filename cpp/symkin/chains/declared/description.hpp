// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "symkin/model/roles.hpp"
#include "symkin/support/types.hpp"

// A leg that a file declares joint by joint: loops of joints and fixed transforms.
namespace symkin::declared {

enum class JointKind { turn, slide };

// A joint moves along or about an axis of its own frame. It stands by itself, or follows another
// joint or the turn of the platform about Z: ratio times that, plus the offset.
struct Joint {
  static constexpr int kOwn = -1;
  static constexpr int kPoseYaw = -2;

  JointKind kind = JointKind::turn;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  bool read = false;   // by a sensor, else passive
  int follows = kOwn;  // a joint that stands by itself, or one of the above
  double ratio = 1;
  double offset = 0;
};

// The numbers of a fixed transform: turn about Z by the azimuth, translate, turn by roll, pitch and
// yaw as URDF does, then by the rotation vector (rx, ry, rz), which is small.
enum class Slot { azimuth, x, y, z, roll, pitch, yaw, rx, ry, rz };
inline constexpr int kSlots = 10;
using TransformValues = std::array<double, kSlots>;

struct Step {
  enum class Kind { transform, joint, pose };
  Kind kind;
  int index = 0;  // of the transform or joint
};

// What must agree at the ends of a loop's two paths: a frame, a point, a rotation, in the plane or
// in space; or that their points are a length apart.
enum class Compares { pose, point, rotation, planar_pose, planar_point, distance };

struct Loop {
  std::vector<Step> left, right;
  Compares compares;
  // Of a distance: the transform whose x it is, or the joint (in no path) that measures it.
  int length_transform = -1;
  int length_joint = -1;
};

// Where else a number stands, times a factor: in a slot of another transform, or as the ratio of a
// joint that follows.
struct Use {
  Step at;
  Slot slot = Slot::x;  // of a transform
  double factor = 1;
};

// One number of a transform by its name; what is held shows nothing that others do not.
struct Scalar {
  std::string name;
  int transform;
  Slot slot;
  ParameterRole role;
  bool held = false;
  std::vector<Use> uses = {};
};

struct Description {
  std::vector<Joint> joints;
  std::vector<TransformValues> transforms;  // as drawn
  std::vector<Loop> loops;
  std::vector<Scalar> scalars;
};

// Joints that stand by themselves, in order.
inline std::vector<int> own_joints(const Description& leg) {
  std::vector<int> own;
  for (std::size_t i = 0; i < leg.joints.size(); ++i) {
    if (leg.joints[i].follows == Joint::kOwn) {
      own.push_back(static_cast<int>(i));
    }
  }
  return own;
}

}  // namespace symkin::declared
