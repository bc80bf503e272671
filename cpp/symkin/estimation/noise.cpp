// SPDX-License-Identifier: MIT
#include "symkin/estimation/noise.hpp"

#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>

#include "symkin/model/pose_space.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

void check_not_negative(std::initializer_list<std::pair<const char*, double>> values,
                        const char* what) {
  for (const auto& [name, value] : values) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw InvalidInput(std::string(what) + " " + name + " = " + std::to_string(value) +
                         "; expected a standard deviation of zero or more");
    }
  }
}

}  // namespace

void MeasurementNoise::check() const {
  check_not_negative({{"position", position}, {"orientation", orientation}, {"reading", reading}},
                     "noise");
  if (position == 0 && orientation == 0 && reading == 0) {
    throw InvalidInput(
        "noise is zero throughout; expected a standard deviation above zero for "
        "the position, the orientation or the reading");
  }
}

Vector MeasurementNoise::pose_variances(PoseSpace space) const {
  Vector variances = Vector::Constant(degrees_of_freedom(space), orientation * orientation);
  variances.head(position_size(space)).setConstant(position * position);
  return variances;
}

Vector closure_variances(const ClosureRows& rows, PoseSpace space, const MeasurementNoise& noise) {
  Vector variances;
  closure_variances(rows, space, noise, variances);
  return variances;
}

void closure_variances(const ClosureRows& rows, PoseSpace space, const MeasurementNoise& noise,
                       Vector& variances) {
  const Index positions = position_size(space);
  const double position = noise.position * noise.position;
  const double orientation = noise.orientation * noise.orientation;
  const double reading = noise.reading * noise.reading;
  variances = reading * rows.by_reading.cwiseAbs2();
  const Index dof = rows.by_pose.cols();
  const double* by_pose = rows.by_pose.data();
  for (Index i = 0; i < variances.size(); ++i) {
    double of_position = 0;
    double of_orientation = 0;
    for (Index k = 0; k < positions; ++k, ++by_pose) {
      of_position += *by_pose * *by_pose;
    }
    for (Index k = positions; k < dof; ++k, ++by_pose) {
      of_orientation += *by_pose * *by_pose;
    }
    variances[i] += position * of_position + orientation * of_orientation;
  }
}

void Tolerances::check() const {
  check_not_negative({{"length", length}, {"angle", angle}, {"gain", gain}}, "tolerance");
}

Vector Tolerances::deviations(const Mechanism& mechanism, Index leg) const {
  const ChainInfo& chain = mechanism.model(leg).info();
  const Vector& parameters = mechanism.leg(leg).parameters;
  Vector deviations = Vector::Zero(parameters.size());
  for (const Index i : mechanism.estimated_parameters(leg)) {
    const ParameterInfo& parameter = chain.parameters[static_cast<std::size_t>(i)];
    deviations[i] = parameter.role.kind == ParameterKind::gain ? gain * std::abs(parameters[i])
                    : chain.is_angular(parameter)              ? angle
                                                               : length;
  }
  return deviations;
}

}  // namespace symkin
