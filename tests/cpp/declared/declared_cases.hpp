// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "symkin/chains/declared/assembly.hpp"

// Declared legs with what another program says of them.
namespace symkin::declared::reference {

struct Case {
  std::vector<double> pose, joints;       // position and quaternion; joints by themselves
  std::vector<int> pivots;                // columns in which the rows are the identity
  std::vector<std::vector<double>> rows;  // pose, readings, errors of every transform
};

struct Leg {
  std::string name, platform;
  std::vector<Joint> joints;
  std::vector<TransformValues> transforms;
  std::vector<Loop> loops;
  std::vector<double> home_pose, home_joints;
  int closures;
  std::vector<Case> cases;

  // The errors of each transform that the rows have, in their order.
  std::vector<Slot> errors() const {
    if (platform.find("planar") == 0) {
      return {Slot::x, Slot::y, Slot::rz};
    }
    return platform == "spherical"
               ? std::vector<Slot>{Slot::rx, Slot::ry, Slot::rz}
               : std::vector<Slot>{Slot::x, Slot::y, Slot::z, Slot::rx, Slot::ry, Slot::rz};
  }

  // The coordinates of the pose among those of a rigid body.
  std::vector<int> coordinates() const {
    return platform == "planar"         ? std::vector<int>{0, 1, 5}
           : platform == "planar point" ? std::vector<int>{0, 1}
           : platform == "translating"  ? std::vector<int>{0, 1, 2}
           : platform == "spherical"    ? std::vector<int>{3, 4, 5}
           : platform == "schoenflies"  ? std::vector<int>{0, 1, 2, 5}
                                        : std::vector<int>{0, 1, 2, 3, 4, 5};
  }

  Description description() const {
    Description made{joints, transforms, loops, {}};
    for (std::size_t i = 0; i < transforms.size(); ++i) {
      for (const Slot slot : errors()) {
        made.scalars.push_back({"", static_cast<int>(i), slot, {}, false});
      }
    }
    return made;
  }
};

inline Pose pose_of(const std::vector<double>& row) {
  return {Eigen::Quaterniond(row[6], row[3], row[4], row[5]).toRotationMatrix(),
          {row[0], row[1], row[2]}};
}

inline Joints joints_of(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Index>(values.size()));
}

}  // namespace symkin::declared::reference
