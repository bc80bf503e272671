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
  template <typename T>
  T active_joint(const T& reading) const {
    return gain * reading + offset;
  }
  template <typename T>
  T by_reading(const T& /*reading*/) const {
    return T(gain);
  }
  template <typename T>
  std::array<T, kParameters> by_parameters(const T& reading) const {
    return {reading, T(1.0)};
  }

  // The reading at q; of an angle within half a turn of the sensor's zero.
  template <typename T>
  T reading(const T& q, bool angular) const {
    const T travel = q - offset;
    return (angular ? wrap_angle(travel) : travel) / gain;
  }

  // reading - other; of an angle by the shortest turn.
  double difference(double reading, double other, bool angular) const {
    return angular ? wrap_angle(gain * (reading - other)) / gain : reading - other;
  }

  double gain, offset;
};

}  // namespace symkin
