// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/leg_estimators.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/identification.hpp"

namespace symkin {

// Identifies robot after robot of one drawing, as identify() does and throws, and in the same room,
// so that a fleet asks for next to no memory.
class Identifier {
 public:
  // Both outlive it.
  Identifier(const Mechanism& mechanism, const IdentificationOptions& options);

  // What the measurements say of all legs, but for the covariance; until the next robot. Where
  // `joint` starts (legs x p) may be known, or empty.
  Identification& identify(const MeasurementSet& measurements, const RowMatrix& start);
  // Of the robot identified last.
  RowMatrix covariance() const;

 private:
  void estimate(std::size_t leg);
  void describe(std::size_t leg);
  void estimate_jointly(const MeasurementSet& measurements);
  bool explained() const;
  RowMatrix covariance_by_influence() const;

  const Mechanism& mechanism_;
  const IdentificationOptions& options_;
  std::vector<LegData> data_;
  std::vector<LegEstimate> estimates_;
  std::vector<LinearFit> seen_;
  Identification result_;
};

}  // namespace symkin
