// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

// What a test of the residuals looks for.
enum class Suspect {
  sensor_curvature,     // a square of the reading is missing from the sensor's model
  sensor_eccentricity,  // cosine and sine of the reading are
  geometry,             // the pose's coordinates or their squares still show in a leg's closures
  order,                // neighbours in the order of measuring are alike (lag 1): a drift
  legs,                 // two legs' closures vary together beyond what the pose's noise explains
  estimators,           // `implicit` and `joint` differ by more than their residuals allow
};

// One test: an F test of terms that the model does not have, exact for unknown noise to first
// order, or a quadratic form of the residuals, compared with its moments for sound ones.
struct ResidualTest {
  Suspect suspect;
  Index leg = -1;        // 0-based; -1: all together
  Index other = -1;      // the second leg of a pair; of geometry, the term that shows most: the
                         // tangent's coordinates in their order, then their squares
  double statistic = 0;  // F, or standard deviations from the mean
  Index terms = 1;       // degrees of freedom of F
  Index spare = 0;
  double p_value = 1;
  double size = 0;  // rms of what the terms explain of the leg's closures, metres
};

// Tests of a robot's residuals at an estimate. To first order they do not depend on which estimator
// found it, since what a change of the parameters could explain is taken out.
struct Diagnosis {
  std::vector<ResidualTest> tests;
  // Of each closure, N x legs: its studentised residual, Student's t from the residuals of all
  // others, whatever the true size of the noise; NaN where a leg was not read. Of several closures
  // a leg the one that stands out most.
  RowMatrix student;
  RowMatrix student_p;  // probability of one as large
  Vector pose_p;        // N: the same for all closures of the pose together (an F test)
  // Noise against what was declared, all legs together (of leg by leg: their mean).
  double chi_square = 0;
  Index degrees_of_freedom = 0;
};

// Diagnoses the closures of all legs at all poses where they were read. The closures of a pose are
// whitened together as in the estimator `joint`; leg by leg where their covariance is singular
// (more legs than degrees of freedom, without a noise of the readings). `rejected` are poses (rows)
// that the tests leave out, and `alarm` is the probability below which, for all poses together, a
// pose is an outlier that the other tests leave out as well. `turning_sensor`: the readings are
// angles, those of legs of different chains where their joints turn.
Diagnosis diagnose(const Mechanism& estimate, const MeasurementSet& measurements,
                   const MeasurementNoise& noise, const std::vector<Index>& rejected,
                   bool turning_sensor, double alarm);

}  // namespace symkin
