// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/estimation/identification.hpp"

namespace symkin {

// The poses and readings that one leg uses.
struct LegData {
  const LegModel& model;
  int working_mode;
  std::vector<Index> rows;  // of the measurements
  RowMatrix poses;
  Vector readings;
  std::vector<Index> estimated;  // which of the parameters; the others stay
};

// The leg's closures at some parameters, their derivatives by the estimated ones, and one over
// their standard deviations by the declared noise. Of several closures at a pose each less what
// those before it say of it, so that their errors are independent.
struct WhitenedLeg {
  ClosureRows rows;
  Vector variances, factors;
};
void whiten(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
            WhitenedLeg& leg);

// Closures and their derivatives by the estimated parameters.
void linearise_closures(const LegData& data, const Vector& parameters, ClosureRows& rows);

// g - psi on the sensor's turn in `rows.closure`, NaN where the leg does not reach, and dg/dparam
// (Eqs. 8, 15) in `rows.by_parameters`.
void linearise_readings(const LegData& data, const Vector& parameters, ClosureRows& rows);

// Standard deviations of g - psi: a typical one, and of each pose in that.
struct ReadingNoise {
  double typical;
  Vector relative;
};
ReadingNoise reading_noise(const LegData& data, const Vector& parameters,
                           const MeasurementNoise& noise);

// What a held noise makes of the residuals: of pose j those that are fitted are T_j times the
// closures, or times g - psi.
struct HeldNoise {
  RowMatrix transforms;  // T, k x k a pose, one below the other
  Vector relative;       // the noise of each pose in fitted residuals, n; 1 of whitened closures
};
HeldNoise hold_noise(const LegData& data, const Vector& parameters, const MeasurementNoise& noise,
                     bool in_readings);

// The first pose without a reading.
std::string unreached_pose(const Vector& errors);
std::string out_of_reach_at_start(const Vector& errors);

// x of least |A x - b|, by QR with columns of length one.
Vector scaled_least_squares(const RowMatrix& a, const Vector& b);

}  // namespace symkin
