// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/row_source.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/symmetry/group.hpp"
#include "symkin/symmetry/pair.hpp"

namespace symkin {

// Symmetries that carry every candidate pose to its orbit. Measured at whole orbits, legs that they
// carry onto each other are all seen equally well.
struct Orbit {
  std::vector<SymmetryPair>
      elements;  // those given, in this order: no others, the identity neither

  static Orbit pose_alone() { return {{SymmetryPair{}}}; }
  // Throws InvalidInput for an element of another group.
  static Orbit of(const SymmetryGroup& group, const std::vector<SymmetryElement>& elements);
};

// Rows that somebody else holds. Unlike ConstRows it never holds a copy of its own.
using RowsView = Eigen::Map<const RowMatrix, 0, Eigen::OuterStride<>>;

// The observability rows of one leg at candidate poses, made when they are asked for. With an orbit
// a candidate brings a row (k where the leg has k closures) an element: that of the leg at the pose
// carried by the element.
class LegRows final : public design::RowSource {
 public:
  // The poses must outlive it; a temporary does not compile. Throws InvalidInput for a leg that
  // does not exist, poses of other coordinates, or an orbit without elements.
  LegRows(Mechanism mechanism, Index leg, const RowsView& poses, RowKind kind,
          const MeasurementNoise& noise = {}, Orbit orbit = Orbit::pose_alone());
  LegRows(Mechanism mechanism, Index leg, const RowMatrix& poses, RowKind kind,
          const MeasurementNoise& noise = {}, Orbit orbit = Orbit::pose_alone());
  LegRows(Mechanism mechanism, Index leg, RowMatrix&& poses, RowKind kind,
          const MeasurementNoise& noise = {}, Orbit orbit = Orbit::pose_alone()) = delete;

  Index size() const override { return poses_.rows(); }
  Index rows_per_pose() const override {
    return static_cast<Index>(orbit_.elements.size()) * closures();
  }
  Index parameters() const override { return mechanism_.estimated_count(leg_); }

  // Rows of NaN where the leg cannot reach.
  void fill(Index first, Index count, double* rows) const override;

 private:
  Index closures() const { return mechanism_.closures(); }

  Mechanism mechanism_;
  Index leg_;
  RowsView poses_;
  RowKind kind_;
  MeasurementNoise noise_;
  Orbit orbit_;
};

}  // namespace symkin
