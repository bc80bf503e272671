// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// Standard deviations of what is measured. Errors of different poses are independent; those of one
// pose are independent and equal in all directions.
struct MeasurementNoise {
  double position = 1e-4;     // m, each coordinate
  double orientation = 1e-4;  // rad, each component of the rotation vector
  double reading = 0;         // rad or m at the active joint's sensor

  void check() const;  // throws InvalidInput
  // Diagonal of Sigma on the pose's tangent.
  Vector pose_variances(PoseSpace space) const;
};

// Variance of each row's closure, m^2, to first order:
//   v = (dh/dpose) Sigma (dh/dpose)' + (dh/dpsi)^2 sigma_q^2.
Vector closure_variances(const ClosureRows& rows, PoseSpace space, const MeasurementNoise& noise);
void closure_variances(const ClosureRows& rows, PoseSpace space, const MeasurementNoise& noise,
                       Vector& variances);

// Standard deviations of what a workshop makes: normal errors of the parameters.
struct Tolerances {
  double length = 1e-3;  // m
  double angle = 1e-3;   // rad
  double gain = 1e-3;    // relative to the gain

  void check() const;  // throws InvalidInput
  // One a parameter of the leg, in the chain's order; zero of those that are not estimated.
  Vector deviations(const Mechanism& mechanism, Index leg) const;
};

}  // namespace symkin
