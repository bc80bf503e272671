// SPDX-License-Identifier: MIT
#include "symkin/estimation/leg_rows.hpp"

#include <utility>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/action.hpp"

namespace symkin {

Orbit Orbit::of(const SymmetryGroup& group, const std::vector<SymmetryElement>& elements) {
  Orbit orbit;
  for (const SymmetryElement element : elements) {
    orbit.elements.push_back(pair_of(group, element));
  }
  return orbit;
}

LegRows::LegRows(Mechanism mechanism, Index leg, const RowMatrix& poses, RowKind kind,
                 const MeasurementNoise& noise, Orbit orbit)
    : LegRows(std::move(mechanism), leg,
              RowsView(poses.data(), poses.rows(), poses.cols(),
                       Eigen::OuterStride<>(poses.outerStride())),
              kind, noise, std::move(orbit)) {}

LegRows::LegRows(Mechanism mechanism, Index leg, const RowsView& poses, RowKind kind,
                 const MeasurementNoise& noise, Orbit orbit)
    : mechanism_(std::move(mechanism)),
      leg_(leg),
      poses_(poses),
      kind_(kind),
      noise_(noise),
      orbit_(std::move(orbit)) {
  static_cast<void>(mechanism_.leg(leg));  // throws if there is none
  check_poses(mechanism_, poses_);
  noise.check();
  if (poses.rows() == 0) {
    throw InvalidInput("there are no candidate poses to select from");
  }
  if (orbit_.elements.empty()) {
    throw InvalidInput("an orbit needs at least one symmetry element");
  }
}

void LegRows::fill(Index first, Index count, double* rows) const {
  const auto elements = static_cast<Index>(orbit_.elements.size());
  const Index size = closures() * parameters();
  const auto own = poses_.middleRows(first, count);
  for (Index k = 0; k < elements; ++k) {
    const SymmetryPair& element = orbit_.elements[static_cast<std::size_t>(k)];
    const RowMatrix carried = element.is_identity()
                                  ? RowMatrix(own)
                                  : transform_poses(element, mechanism_.pose_space(), own);
    // The k-th row of each candidate, or rows one behind the other.
    Eigen::Map<RowMatrix, 0, Eigen::OuterStride<>> of_element(
        rows + k * size, count, size, Eigen::OuterStride<>(elements * size));
    const RowMatrix made = observability_rows(mechanism_, leg_, carried, kind_, noise_);
    of_element = Eigen::Map<const RowMatrix>(made.data(), count, size);
  }
}

}  // namespace symkin
