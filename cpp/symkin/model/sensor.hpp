// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>

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

// A sensor that is not quite straight, q = gain * psi + offset + c psi^2 + a cos psi + b sin psi:
// spools and soft drives bend (c), an eccentric encoder errs once a turn (a, b; psi in radians).
struct CurvedSensor {
  static constexpr std::array<ParameterInfo, 3> kCurvatureInfos{
      {{"sensor_quadratic", {End::none, ParameterKind::curvature}},
       {"sensor_cosine", {End::none, ParameterKind::curvature}},
       {"sensor_sine", {End::none, ParameterKind::curvature}}}};

  double active_joint(double reading) const {
    return straight.active_joint(reading) + quadratic * reading * reading +
           cosine * std::cos(reading) + sine * std::sin(reading);
  }
  double by_reading(double reading) const {
    return straight.gain + 2 * quadratic * reading - cosine * std::sin(reading) +
           sine * std::cos(reading);
  }
  // gain, offset, quadratic, cosine, sine
  static std::array<double, 5> by_parameters(double reading) {
    return {reading, 1, reading * reading, std::cos(reading), std::sin(reading)};
  }

  LinearSensor straight;
  double quadratic, cosine, sine;
};

}  // namespace symkin
