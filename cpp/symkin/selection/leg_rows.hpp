// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/observability.hpp"
#include "symkin/selection/candidate_rows.hpp"
#include "symkin/symmetry/group.hpp"

namespace symkin {

// Elements of a group that carry every candidate pose to its orbit. Measured at whole orbits, legs
// that the group carries onto each other are all seen equally well.
struct Orbit {
  SymmetryGroup group;
  std::vector<SymmetryElement> elements;  // those given, in this order: no others, r0 neither
};

// The observability rows of one leg at candidate poses, made when they are asked for. With an orbit
// a candidate brings one row an element: that of the leg at the pose carried by the element.
class LegRows final : public RowSource {
 public:
  // The mechanism and the poses must outlive it. Throws InvalidInput for a leg that does not exist,
  // poses of other coordinates, or an orbit without elements.
  LegRows(const Mechanism& mechanism, Index leg, ConstRows poses, RowKind kind,
          const MeasurementNoise& noise = {});
  LegRows(const Mechanism& mechanism, Index leg, ConstRows poses, RowKind kind,
          const MeasurementNoise& noise, Orbit orbit);

  Index size() const override { return poses_.rows(); }
  Index rows_per_pose() const override { return static_cast<Index>(orbit_.elements.size()); }
  Index parameters() const override { return mechanism_.parameter_count(); }

  // Rows of NaN where the leg cannot reach.
  void fill(Index first, Index count, double* rows) const override;

 private:
  const Mechanism& mechanism_;
  Index leg_;
  ConstRows poses_;
  RowKind kind_;
  MeasurementNoise noise_;
  Orbit orbit_;
};

}  // namespace symkin
