// SPDX-License-Identifier: MIT
#include "symkin/model/mechanism.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "symkin/model/estimated_parameters.hpp"
#include "symkin/model/impossible_leg.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// What an overconstrained mechanism wants.
constexpr const char* kLooser =
    "more joints that turn or slide freely, or a platform that moves as it is meant to, such as "
    "\"translating\"";

// Throws where the leg is not possible; of what it does not have the value becomes zero.
void check_leg(const ChainInfo& info, Leg& leg, std::size_t number) {
  const std::string where = "leg " + std::to_string(number) + " of chain " + std::string(info.name);
  const auto count = static_cast<Index>(info.parameters.size());
  if (leg.parameters.size() != count) {
    throw InvalidInput(where + " has " + std::to_string(leg.parameters.size()) +
                       " parameters; expected " + std::to_string(count));
  }
  for (Index i = 0; i < count; ++i) {
    const auto& [name, role, held] = info.parameters[static_cast<std::size_t>(i)];
    if (role.kind == ParameterKind::absent) {
      leg.parameters[i] = 0;
      continue;
    }
    const double value = leg.parameters[i];
    const std::string what = where + ": " + std::string(name) + " = " + std::to_string(value);
    if (!std::isfinite(value)) {
      throw ImpossibleLeg(what + "; expected a finite number");
    }
    if (role.kind == ParameterKind::length && value <= 0) {
      throw ImpossibleLeg(what + "; expected a positive length");
    }
    if (role.kind == ParameterKind::pulley_radius && value < 0) {
      throw ImpossibleLeg(what + "; expected a radius that is not negative");
    }
    if (role.kind == ParameterKind::arc && !(value > 0 && value < kPi)) {
      throw ImpossibleLeg(what + "; expected an arc between 0 and pi rad");
    }
    if (role.kind == ParameterKind::gain && value == 0) {
      throw ImpossibleLeg(what + "; a sensor with zero gain shows nothing");
    }
  }
  if (!std::isfinite(leg.home_reading)) {
    throw InvalidInput(where + ": the reading at home is not finite");
  }
  if (leg.working_mode != 1 && leg.working_mode != -1) {
    throw InvalidInput(where + ": working_mode = " + std::to_string(leg.working_mode) +
                       "; expected 1 or -1");
  }
}

bool all_alike(const std::vector<const ChainModel*>& chains) {
  return std::all_of(chains.begin(), chains.end(),
                     [&](const ChainModel* chain) { return chain == chains.front(); });
}

// The chain of all legs, null where they have several.
const ChainModel* common_chain(const std::string& name,
                               const std::vector<const ChainModel*>& chains, std::size_t legs) {
  if (chains.empty() || chains.size() != legs) {
    throw InvalidInput("mechanism \"" + name + "\" has " + std::to_string(legs) + " legs and " +
                       std::to_string(chains.size()) + " chains; expected a chain a leg");
  }
  return all_alike(chains) ? chains.front() : nullptr;
}

}  // namespace

std::vector<Index> free_coordinates(const ChainInfo& chain) {
  if (!chain.free.empty()) {
    return chain.free;
  }
  if (chain.pose_space == PoseSpace::spatial && binding_closures(chain) > 0) {
    return {2, 3, 4};
  }
  std::vector<Index> all(static_cast<std::size_t>(degrees_of_freedom(chain.pose_space)));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

Mechanism::Mechanism(std::string name, const ChainModel& chain, std::vector<Leg> legs)
    : Mechanism(std::move(name), &chain, LegModels(), std::move(legs)) {}

Mechanism::Mechanism(const std::string& name, const std::vector<const ChainModel*>& chains,
                     const std::vector<Leg>& legs)
    : Mechanism(name, common_chain(name, chains, legs.size()),
                all_alike(chains) ? LegModels() : in_one_layout(chains), legs) {}

Mechanism::Mechanism(std::string name, const ChainModel* chain, LegModels models,
                     std::vector<Leg> legs)
    : name_(std::move(name)), chain_(chain), models_(std::move(models)) {
  for (std::size_t i = 0; i < legs.size(); ++i) {
    check_leg((mixed() ? *models_[i] : *chain_).info(), legs[i], i + 1);
  }
  legs_ = std::make_shared<const std::vector<Leg>>(std::move(legs));
  for (const Leg& leg : *legs_) {
    leg_values_.push_back({leg.parameters.data(), leg.working_mode});
  }
  if (leg_count() * closures() < dof() && !hangs() && reading_count() == leg_count()) {
    throw InvalidInput("mechanism \"" + name_ + "\" has " + std::to_string(leg_count()) +
                       " legs; a " + std::string(to_string(pose_space())) + " platform has " +
                       std::to_string(dof()) + " degrees of freedom and needs as many");
  }
  if (mixed() && mobility() < dof()) {
    check_bound();
  }
  if (pose_space() == PoseSpace::spatial && closures() > 1 && redundant()) {
    if (info().find({End::none, ParameterKind::handedness}) < info().parameters.size()) {
      throw InvalidInput("mechanism \"" + name_ + "\" is overconstrained: " +
                         std::to_string(leg_count()) + " legs of " + std::to_string(closures()) +
                         " equations bind more than the platform's 6 coordinates, so that it does "
                         "not assemble with any error; expected fewer legs, " +
                         kLooser);
    }
    throw InvalidInput("mechanism \"" + name_ + "\" has " + std::to_string(leg_count()) +
                       " legs of chain " + std::string(info().name) + "; expected " +
                       std::to_string(dof() / closures()) +
                       ", since each binds the platform to a plane");
  }
  if (mixed()) {
    for (Index i = 0; i < leg_count(); ++i) {
      estimated_.push_back(
          symkin::estimated_parameters(model(i).info(), leg(i).parameters.transpose()).front());
    }
  } else {
    estimated_ = symkin::estimated_parameters(info(), parameters());
  }
}

// Legs of which some are without a reading.
void Mechanism::check_bound() const {
  const auto number = [](Index count) { return std::to_string(count); };
  const std::string what = "mechanism \"" + name_ + "\" has " + number(reading_count()) +
                           " readings and " + number(dof() - mobility()) +
                           " equations that bind its platform";
  if (reading_count() > mobility()) {
    throw InvalidInput(
        what + ", so that it does not assemble with any error; expected " + number(dof()) +
        " together, the platform's coordinates: fewer joints that are read, " + kLooser);
  }
  if (reading_count() < mobility()) {
    throw InvalidInput(
        what + ", which leave it free; expected " + number(dof()) +
        " together, the platform's coordinates: more joints that are read, or fewer");
  }
  if (const auto free = static_cast<Index>(free_coordinates().size()); free != mobility()) {
    throw InvalidInput(what + ", which leave it " + number(mobility()) +
                       " coordinates that can be chosen; expected as many in free, and not " +
                       number(free));
  }
}

Index Mechanism::mobility() const {
  Index left = dof();
  for (Index i = 0; i < leg_count(); ++i) {
    left -= binding_closures(model(i).info());
  }
  return left;
}

Index Mechanism::reading_count() const {
  Index count = 0;
  for (Index i = 0; i < leg_count(); ++i) {
    count += model(i).info().read ? 1 : 0;
  }
  return count;
}

std::vector<Index> Mechanism::free_coordinates() const {
  for (Index i = 0; i < leg_count(); ++i) {
    if (binding_closures(model(i).info()) > 0) {
      return symkin::free_coordinates(model(i).info());
    }
  }
  return symkin::free_coordinates(info());
}

bool Mechanism::hangs() const {
  for (Index i = 0; i < leg_count(); ++i) {
    if (!(mixed() ? *models_[static_cast<std::size_t>(i)] : *chain_).info().hangs) {
      return false;
    }
  }
  return leg_count() > 0;
}

const LegModel& Mechanism::model(Index leg) const {
  static_cast<void>(this->leg(leg));  // throws if there is none
  return mixed() ? *models_[static_cast<std::size_t>(leg)] : *chain_;
}

const Leg& Mechanism::leg(Index index) const {
  if (index < 0 || index >= leg_count()) {
    throw InvalidInput("leg " + std::to_string(index) + "; expected 0 to " +
                       std::to_string(leg_count() - 1));
  }
  return legs()[static_cast<std::size_t>(index)];
}

const std::vector<Index>& Mechanism::estimated_parameters(Index leg) const {
  static_cast<void>(this->leg(leg));  // throws if there is none
  return estimated_[static_cast<std::size_t>(leg)];
}

Index Mechanism::estimated_count(Index leg) const {
  return static_cast<Index>(estimated_parameters(leg).size());
}

Index Mechanism::first_estimated(Index leg) const {
  Index first = 0;
  for (Index before = 0; before < leg; ++before) {
    first += estimated_count(before);
  }
  return first;
}

Mechanism Mechanism::with_parameters(ConstRows parameters) const {
  if (parameters.rows() != leg_count() || parameters.cols() != parameter_count()) {
    throw InvalidInput("parameters are " + std::to_string(parameters.rows()) + " x " +
                       std::to_string(parameters.cols()) + "; expected " +
                       std::to_string(leg_count()) + " legs x " +
                       std::to_string(parameter_count()));
  }
  std::vector<Leg> legs = *legs_;
  for (Index i = 0; i < leg_count(); ++i) {
    legs[static_cast<std::size_t>(i)].parameters = parameters.row(i).transpose();
  }
  return with_legs(std::move(legs));
}

Mechanism Mechanism::with_legs(std::vector<Leg> legs) const {
  if (mixed() && legs.size() != models_.size()) {
    throw InvalidInput("mechanism \"" + name_ + "\" has legs of " + std::to_string(models_.size()) +
                       " chains; got " + std::to_string(legs.size()) + " legs");
  }
  return {name_, chain_, models_, std::move(legs)};
}

RowMatrix Mechanism::parameters() const {
  RowMatrix values(leg_count(), parameter_count());
  for (Index i = 0; i < leg_count(); ++i) {
    values.row(i) = leg(i).parameters.transpose();
  }
  return values;
}

void check_poses(const Mechanism& mechanism, ConstRows poses) {
  const Index expected = coordinate_count(mechanism.pose_space());
  if (poses.cols() != expected) {
    throw InvalidInput("poses have " + std::to_string(poses.cols()) + " columns; a " +
                       std::string(to_string(mechanism.pose_space())) + " pose has " +
                       std::to_string(expected));
  }
}

void check_readings(const Mechanism& mechanism, Index poses, ConstRows readings) {
  if (readings.rows() != poses || readings.cols() != mechanism.leg_count()) {
    throw InvalidInput("readings are " + std::to_string(readings.rows()) + " x " +
                       std::to_string(readings.cols()) + "; expected " + std::to_string(poses) +
                       " poses x " + std::to_string(mechanism.leg_count()) + " legs");
  }
}

void check_leg_readings(Index poses, ConstVector readings) {
  if (readings.size() != poses) {
    throw InvalidInput("readings are " + std::to_string(readings.size()) + "; expected " +
                       std::to_string(poses) + ", one a pose");
  }
}

}  // namespace symkin
