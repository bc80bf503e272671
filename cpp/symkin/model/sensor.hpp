// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "symkin/model/pose_space.hpp"
#include "symkin/model/roles.hpp"

namespace symkin {

// What the sensor of a leg shows: the active joint variable is q = gain * psi + offset, psi the
// reading (Eq. 6 of the paper). Another law is another type with these members, given to
// LegModelOf; its parameters stand behind those of the leg's geometry.
struct LinearSensor {
  static constexpr int kParameters = 2;
  static constexpr std::array<ParameterInfo, kParameters> kParameterInfos{
      {{"sensor_gain", {End::none, ParameterKind::gain}},
       {"sensor_offset", {End::none, ParameterKind::offset}}}};

  explicit LinearSensor(const double* parameters) : gain(parameters[0]), offset(parameters[1]) {}

  // q, dq/dpsi and dq/dparam at a reading.
  double active_joint(double reading) const { return gain * reading + offset; }
  double by_reading(double /*reading*/) const { return gain; }
  std::array<double, kParameters> by_parameters(double reading) const { return {reading, 1}; }

  // The reading at q; of an angle within half a turn of the sensor's zero.
  double reading(double q, bool angular) const {
    const double travel = q - offset;
    return (angular ? wrap_angle(travel) : travel) / gain;
  }

  // reading - other; of an angle by the shortest turn.
  double difference(double reading, double other, bool angular) const {
    return angular ? wrap_angle(gain * (reading - other)) / gain : reading - other;
  }

  double gain, offset;
};

}  // namespace symkin
