// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "symkin/model/roles.hpp"

namespace symkin::testing {

// q = gain psi + bend psi^3 + offset, growing with psi.
struct BentSensor {
  static constexpr int kParameters = 3;
  static constexpr std::array<ParameterInfo, kParameters> kParameterInfos{
      {{"gain", {End::none, ParameterKind::gain}},
       {"bend", {End::none, ParameterKind::gain}},
       {"offset", {End::none, ParameterKind::offset}}}};

  explicit BentSensor(const double* parameters)
      : gain(parameters[0]), bend(parameters[1]), offset(parameters[2]) {}

  double active_joint(double psi) const { return gain * psi + bend * psi * psi * psi + offset; }
  double by_reading(double psi) const { return gain + 3 * bend * psi * psi; }
  std::array<double, kParameters> by_parameters(double psi) const {
    return {psi, psi * psi * psi, 1};
  }
  double reading(double q, bool /*angular*/) const {
    double psi = (q - offset) / gain;
    for (int i = 0; i < 50; ++i) {
      psi -= (active_joint(psi) - q) / by_reading(psi);
    }
    return psi;
  }
  double difference(double reading, double other, bool /*angular*/) const {
    return reading - other;
  }

  double gain, bend, offset;
};

}  // namespace symkin::testing
