// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// How parameter errors become end-effector errors, averaged over poses. To first order an error of
// the parameters moves the end effector by E = -(dh/dpose)^-1 (dh/dparam) (least squares with more
// legs than degrees of freedom); the weights are the means of E'E for the position and for the
// orientation part, (legs p) x (legs p), leg by leg. A pose that is out of reach or singular has no
// E; it is left out and counted.
struct AccuracyWeights {
  RowMatrix position;     // m^2 per squared parameter unit
  RowMatrix orientation;  // rad^2 per squared parameter unit
  Index evaluated = 0;
  Index failed = 0;
};
AccuracyWeights accuracy_weights(const Mechanism& mechanism, ConstRows poses);

// Expected root mean square end-effector error, for parameter estimates with this covariance.
struct ExpectedAccuracy {
  double position;     // m
  double orientation;  // rad
};
ExpectedAccuracy expected_accuracy(const AccuracyWeights& weights, ConstRows covariance);

}  // namespace symkin
