// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "symkin/model/roles.hpp"
#include "symkin/support/types.hpp"

namespace symkin {

// What a mirror makes of how the joints of a declared leg stand at home: they follow each other so
// that there is none, it is the leg of the other hand, or they stand as they do.
enum class MirrorImage { none, other_hand, same };

struct ChainInfo {
  std::string_view name;
  PoseSpace pose_space;
  std::vector<ParameterInfo> parameters;  // of the geometry, then of the sensor
  ActiveJoint active_joint;
  int closures;                   // equations a leg
  bool mode_is_orientation;       // a reflection flips the working mode
  std::string_view working_mode;  // what the sign of the working mode means
  std::vector<Index> free{};      // see free_coordinates(); empty where the pose space tells
  std::string_view runs_as{};     // the known chain that a declared one is, if it is one
  MirrorImage mirror_image = MirrorImage::none;
  bool hangs = false;  // declared as a length that is read: see Mechanism::hangs()
  // Whether a sensor reads the leg, which is what its first closure shows. Of one without any
  // readings are zero, and are in no closure: all of them bind the platform.
  bool read = true;

  // Radians; an offset has the unit of the active joint.
  bool is_angular(const ParameterInfo& parameter) const {
    return is_angle(parameter.role.kind) ||
           (parameter.role.kind == ParameterKind::offset && is_angle(active_joint));
  }

  // Place of the first parameter of that role; the number of parameters if there is none.
  std::size_t find(ParameterRole role) const {
    std::size_t i = 0;
    while (i < parameters.size() && !(parameters[i].role == role)) {
      ++i;
    }
    return i;
  }
};

}  // namespace symkin
