// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "symkin/chains/declared/loops.hpp"
#include "symkin/model/chain_info.hpp"

namespace symkin::declared {

// A pose and the values there of the joints that stand by themselves: by these a leg's branch is
// known, passive joints included.
struct Home {
  Pose pose;
  Joints joints;
};

// How many equations of a drawn leg no joint can meet, be it read or not: they bind the platform.
// Or no `passive` joint: those are all closures.
int binding_closures(const Description& leg, const Home& home, bool passive = false);

class PivotedQr;

// A leg put together: its joints at a pose, and its closures there, which are the equations that no
// passive joint can meet. How many these are is a matter of the drawing, and is fixed at home.
class Assembly {
 public:
  // Throws InvalidInput where the drawn leg does not close at home, leaves no closure ("a leg with
  // as many freedoms as equations binds nothing"), or a sensor shows nothing.
  Assembly(const Description& leg, const Home& home);

  // Another leg of the same kind; mirrored in the plane of x and z of each joint's frame or not.
  // Ranks stay those of the drawing.
  void set_leg(ConstVector scalars, bool mirrored);

  int closures() const { return closures_; }
  MirrorImage mirror_image() const;  // of the drawn leg
  const Loops& loops() const { return loops_; }
  const std::vector<int>& read() const { return read_; }  // among the joints by themselves
  const Joints& home_joints() const { return home_joints_; }

  // For the kernels, which read it as long as this and `transforms` live; false where joints may
  // move without the leg's ends: they cannot choose among columns.
  bool lane_leg(std::vector<LaneTransform>& transforms, LaneLeg& leg) const;

  // All joints by themselves at a pose, on the branch of home; false where there is none. From home
  // at once, or by steps: unless one of two shares of the way is reached from home, by none.
  bool close(const Pose& pose, Joints& joints);
  static constexpr std::array<double, 2> kTriedShares{1.0 / 64, 1.0 / 2};
  static constexpr double kFarthest = 1;  // m and rad, that joints move in a step
  Pose on_the_way(const Pose& pose, double share) const;
  // The same with the read joints as they are given in `joints`: the others come as near to closing
  // the leg as they can, which is always somewhere; false where it is not on the branch of home.
  bool close_around_readings(const Pose& pose, Joints& joints);

  // How far a pose is from the leg's next singularity, by moving along coordinates of a rigid body:
  // exact in first order near it. Negative, about how far the leg misses, where it does not close;
  // infinite where none is near.
  double reach_margin(const Pose& pose, const std::vector<int>& tangent);
  // The same where the leg is known not to close, and of one that closes, by slopes of its first
  // closure along the first reading at the pose and those around it.
  double missed(const Pose& pose);
  static std::vector<Pose> around(const Pose& pose, const std::vector<int>& tangent);
  static double margin_of(const double* slopes, std::size_t count);

  // Unit vectors, equations x closures, square to what passive joints do where the joints are now.
  // One is oriented like the passive joints' columns; of several the first alone does work with the
  // first reading.
  const Columns& reciprocal();

 private:
  void find_elimination();
  bool newton(const Pose& pose, const std::vector<int>& moving, int rank, Joints& joints);
  void walk(const Pose& pose, const Joints& joints);
  bool on_branch();
  double by_first_reading();
  double orientation(const PivotedQr& qr) const;
  bool near_home(const Pose& pose, Joints& joints);
  bool follow(const Pose& pose, Joints& joints);

  Loops loops_;
  Home home_;
  Joints home_joints_, mirror_signs_;
  bool can_be_mirrored_ = true;
  std::vector<int> read_, passive_, all_, basis_;
  std::vector<int>
      moving_;              // without those that move nothing at home: passive ones, then read ones
  int moving_passive_ = 0;  // of these
  // As the kernels take these, all and the passive ones; null where they depend on each other.
  std::shared_ptr<const std::array<Elimination, 2>> elimination_;
  int closures_ = 0, passive_rank_ = 0, whole_rank_ = 0;
  double home_side_ = 1, drawn_side_ = 1, mirrored_side_ = 1;
  // Where the joints are now, once asked for.
  bool known_here_ = false;
  Columns columns_, reciprocal_;
};

}  // namespace symkin::declared
