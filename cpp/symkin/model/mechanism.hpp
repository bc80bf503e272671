// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "symkin/model/leg_model.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// The values of one leg; their names are model().info().parameters.
struct Leg {
  Vector parameters;
  int working_mode = -1;  // +1 or -1: which root of the closure
};

// The coordinates of a pose's tangent that can be chosen where legs of the chain carry the
// platform. All of them, or for legs with more closures than one, which leave it three: in space
// the height and the two tilts.
std::vector<Index> free_coordinates(const ChainInfo& chain);

// A parallel mechanism: legs of one chain on a base, carrying one platform.
class Mechanism {
 public:
  // Throws InvalidInput that names the leg and the parameter: at least as many closures as degrees
  // of freedom, in space three legs of two closures, finite parameters, positive lengths (a radius
  // or a guide offset may be zero or negative), arcs between 0 and pi, gains other than zero, modes
  // +1 or -1.
  Mechanism(std::string name, const LegModel& model, std::vector<Leg> legs);

  const std::string& name() const { return name_; }
  const LegModel& model() const { return *model_; }
  const std::vector<Leg>& legs() const { return *legs_; }
  const Leg& leg(Index index) const;
  // For the model's loops over all legs; no longer valid than the mechanism and its copies.
  const std::vector<LegValues>& leg_values() const { return leg_values_; }

  PoseSpace pose_space() const { return model_->info().pose_space; }
  Index dof() const { return degrees_of_freedom(pose_space()); }
  // Degrees of freedom that the legs leave the platform: fewer than dof() where a leg has more
  // closures than one.
  Index mobility() const { return dof() - leg_count() * (model_->info().closures - 1); }
  // Whether the readings are more than the degrees of freedom, so that they contradict each other.
  bool redundant() const { return leg_count() > mobility(); }
  Index leg_count() const { return static_cast<Index>(legs_->size()); }
  Index parameter_count() const { return model_->parameter_count(); }

  // See estimated_parameters(); how many they are is the same for all legs.
  const std::vector<Index>& estimated_parameters(Index leg) const;
  const std::vector<std::vector<Index>>& estimated_parameters() const { return estimated_; }
  Index estimated_count() const { return static_cast<Index>(estimated_.front().size()); }

  // The same mechanism with other parameter values, legs x p.
  Mechanism with_parameters(ConstRows parameters) const;
  RowMatrix parameters() const;

 private:
  std::string name_;
  const LegModel* model_;
  std::shared_ptr<const std::vector<Leg>> legs_;  // never changed, so that copies share them
  std::vector<LegValues> leg_values_;
  std::vector<std::vector<Index>> estimated_;
};

// Throws InvalidInput unless the array has one column a coordinate of the mechanism's poses.
void check_poses(const Mechanism& mechanism, ConstRows poses);
// Throws InvalidInput unless there is one row a pose and one column a leg.
void check_readings(const Mechanism& mechanism, Index poses, ConstRows readings);
// The same for the readings of one leg.
void check_leg_readings(Index poses, ConstVector readings);

}  // namespace symkin
