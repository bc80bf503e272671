// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "symkin/model/chain_model.hpp"
#include "symkin/model/leg_layout.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// The values of one leg; their names are model(leg).info().parameters.
struct Leg {
  Vector parameters;
  int working_mode = -1;  // +1 or -1: which root of the closure
  // What an angular sensor shows at home. The readings of poses are counted from there, within half
  // a turn either way, so that none is cut where a workspace passes half a turn from its zero.
  double home_reading = 0;
};

// How many of a leg's closures bind the platform: all but the one that shows the reading.
inline Index binding_closures(const ChainInfo& chain) {
  return chain.closures - (chain.read ? 1 : 0);
}

// The coordinates of a pose's tangent that can be chosen where legs of the chain carry the
// platform. All of them, or for legs that bind it, which leave it three: in space the height and
// the two tilts.
std::vector<Index> free_coordinates(const ChainInfo& chain);

// A parallel mechanism: legs on a base, carrying one platform. They are of one chain, or each of
// its own, in one layout of parameters (see in_one_layout); of a parameter that a leg does not have
// the value is zero, whatever is given.
class Mechanism {
 public:
  // Throws InvalidInput that names the leg and the parameter: at least as many closures as degrees
  // of freedom, unless it hangs, in space three legs of two closures, finite parameters, positive
  // lengths (a radius or a guide offset may be zero or negative), arcs between 0 and pi, gains
  // other than zero, modes +1 or -1.
  Mechanism(std::string name, const ChainModel& chain, std::vector<Leg> legs);
  // A chain a leg; where all are the same object, as above.
  Mechanism(const std::string& name, const std::vector<const ChainModel*>& chains,
            const std::vector<Leg>& legs);

  const std::string& name() const { return name_; }
  // Of one leg, in the layout of all. Legs of one chain share it.
  const LegModel& model(Index leg) const;
  // The chain of all legs, for loops over them at once; null where they are of different chains.
  const ChainModel* chain() const { return chain_; }
  bool mixed() const { return chain_ == nullptr; }
  bool of_one_chain(Index leg, Index other) const { return &model(leg) == &model(other); }
  const std::vector<Leg>& legs() const { return *legs_; }
  const Leg& leg(Index index) const;
  // For the chain's loops over all legs; no longer valid than the mechanism and its copies.
  const std::vector<LegValues>& leg_values() const { return leg_values_; }

  PoseSpace pose_space() const { return info().pose_space; }
  Index dof() const { return degrees_of_freedom(pose_space()); }
  // Degrees of freedom that the legs leave the platform: fewer than dof() where a leg has more
  // closures than the one that shows its reading.
  Index mobility() const;
  // Whether the readings are more than the degrees of freedom, so that they contradict each other.
  bool redundant() const { return reading_count() > mobility(); }
  // Legs that a sensor reads.
  Index reading_count() const;
  // Whether a closure, of all legs' in order, is the one of its leg that shows the reading.
  bool shows_reading(Index closure) const {
    return closure % closures() == 0 && model(closure / closures()).info().read;
  }
  // See free_coordinates().
  std::vector<Index> free_coordinates() const;
  // Whether the legs may be fewer than the degrees of freedom, gravity deciding the rest: all of
  // them are declared as lengths that are read, as cables are.
  bool hangs() const;
  // Whether readings leave the pose undetermined.
  bool underdetermined() const { return leg_count() * closures() < dof(); }
  Index leg_count() const { return static_cast<Index>(legs_->size()); }
  Index closures() const { return info().closures; }  // of a leg, of each as many
  Index parameter_count() const { return static_cast<Index>(info().parameters.size()); }

  // See estimated_parameters().
  const std::vector<Index>& estimated_parameters(Index leg) const;
  const std::vector<std::vector<Index>>& estimated_parameters() const { return estimated_; }
  Index estimated_count(Index leg) const;
  // Where a leg's begin among the estimated parameters of all legs, leg by leg; of leg_count() how
  // many these are.
  Index first_estimated(Index leg) const;

  // The same mechanism with other parameter values, legs x p, or with other legs of these chains.
  Mechanism with_parameters(ConstRows parameters) const;
  Mechanism with_legs(std::vector<Leg> legs) const;
  RowMatrix parameters() const;

 private:
  Mechanism(std::string name, const ChainModel* chain, LegModels models, std::vector<Leg> legs);

  void check_bound() const;  // throws InvalidInput

  // What is the same for all legs.
  const ChainInfo& info() const { return (mixed() ? *models_.front() : *chain_).info(); }

  std::string name_;
  const ChainModel* chain_;
  LegModels models_;                              // where there is no such chain
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
