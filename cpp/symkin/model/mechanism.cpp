// SPDX-License-Identifier: MIT
#include "symkin/model/mechanism.hpp"

#include <cmath>
#include <numeric>

#include "symkin/model/estimated_parameters.hpp"
#include "symkin/model/impossible_leg.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

void check_leg(const ChainInfo& info, const Leg& leg, std::size_t number) {
  const std::string where = "leg " + std::to_string(number) + " of chain " + std::string(info.name);
  const auto count = static_cast<Index>(info.parameters.size());
  if (leg.parameters.size() != count) {
    throw InvalidInput(where + " has " + std::to_string(leg.parameters.size()) +
                       " parameters; expected " + std::to_string(count));
  }
  for (Index i = 0; i < count; ++i) {
    const auto& [name, role] = info.parameters[static_cast<std::size_t>(i)];
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
  if (leg.working_mode != 1 && leg.working_mode != -1) {
    throw InvalidInput(where + ": working_mode = " + std::to_string(leg.working_mode) +
                       "; expected 1 or -1");
  }
}

}  // namespace

std::vector<Index> free_coordinates(const ChainInfo& chain) {
  if (chain.pose_space == PoseSpace::spatial && chain.closures > 1) {
    return {2, 3, 4};
  }
  std::vector<Index> all(static_cast<std::size_t>(degrees_of_freedom(chain.pose_space)));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

Mechanism::Mechanism(std::string name, const LegModel& model, std::vector<Leg> legs)
    : name_(std::move(name)),
      model_(&model),
      legs_(std::make_shared<const std::vector<Leg>>(std::move(legs))) {
  for (const Leg& leg : *legs_) {
    check_leg(model.info(), leg, leg_values_.size() + 1);
    leg_values_.push_back({leg.parameters.data(), leg.working_mode});
  }
  if (leg_count() * model.info().closures < dof()) {
    throw InvalidInput("mechanism \"" + name_ + "\" has " + std::to_string(leg_count()) +
                       " legs; a " + std::string(to_string(pose_space())) + " platform has " +
                       std::to_string(dof()) + " degrees of freedom and needs as many");
  }
  if (pose_space() == PoseSpace::spatial && model.info().closures > 1 && redundant()) {
    throw InvalidInput("mechanism \"" + name_ + "\" has " + std::to_string(leg_count()) +
                       " legs of chain " + std::string(model.info().name) + "; expected " +
                       std::to_string(dof() / model.info().closures) +
                       ", since each binds the platform to a plane");
  }
  estimated_ = symkin::estimated_parameters(model.info(), parameters());
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
  return {name_, *model_, std::move(legs)};
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
