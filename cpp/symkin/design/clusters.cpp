// SPDX-License-Identifier: MIT
#include "symkin/design/clusters.hpp"

#include <limits>

namespace symkin {

RowMatrix candidate_points(const ColumnBlocks& candidates, Index parameters) {
  RowMatrix points(candidates.count(), candidates.columns());
  // Any direction will do that no row is likely to be orthogonal to.
  const Vector side = Vector::LinSpaced(parameters, 1, 2).array().sqrt().sin();
  for (Index j = 0; j < points.rows(); ++j) {
    candidates.get(j, points.row(j).data());
    for (Index first = 0; first < points.cols(); first += parameters) {
      auto row = points.row(j).segment(first, parameters);
      if (row.dot(side) < 0) {
        row *= -1;
      }
    }
  }
  return points;
}

std::vector<Index> farthest_first_clusters(const RowMatrix& points, Index count) {
  const Index n = points.rows();
  std::vector<Index> cluster(static_cast<std::size_t>(n), 0);
  Vector distance = Vector::Constant(n, std::numeric_limits<double>::infinity());
  Index centre = 0;
  for (Index k = 0; k < count; ++k) {
    for (Index j = 0; j < n; ++j) {
      const double d = (points.row(j) - points.row(centre)).squaredNorm();
      if (d < distance[j]) {
        distance[j] = d;
        cluster[static_cast<std::size_t>(j)] = k;
      }
    }
    if (!(distance.maxCoeff(&centre) > 0)) {
      break;
    }
  }
  return cluster;
}

}  // namespace symkin
