// SPDX-License-Identifier: MIT
#include "symkin/model/leg_model.hpp"

#include <algorithm>
#include <initializer_list>

namespace symkin {
namespace {

// Rows of any width that belong to closures.
struct Beside {
  double* rows;
  Index width;
};

// Closures of legs and poses in blocks of so many, and what else their rows hold.
void eliminate_reading(Index closures, Eigen::Ref<Vector> by_reading,
                       std::initializer_list<Beside> all) {
  for (Index first = 0; first < by_reading.size(); first += closures) {
    for (Index row = first + 1; row < first + closures; ++row) {
      const double share = by_reading[row] / by_reading[first];
      for (const Beside& each : all) {
        for (Index i = 0; i < each.width; ++i) {
          each.rows[row * each.width + i] -= share * each.rows[first * each.width + i];
        }
      }
      by_reading[row] = 0;
    }
  }
}

}  // namespace

void ClosureRows::eliminate_reading(Index closures) {
  symkin::eliminate_reading(closures, by_reading,
                            {{closure.data(), 1},
                             {by_parameters.data(), by_parameters.cols()},
                             {by_pose.data(), by_pose.cols()}});
}

void PoseDerivatives::eliminate_reading(Index closures) {
  const Index dof = by_pose.cols() / std::max<Index>(by_reading.cols(), 1);
  symkin::eliminate_reading(closures, Eigen::Map<Vector>(by_reading.data(), by_reading.size()),
                            {{closure.data(), 1}, {by_pose.data(), dof}});
}

// Asked for too seldom for a kernel of its own.
void LegModel::closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                       Eigen::Ref<Vector> values) const {
  ClosureRows rows;
  linearise_pose(parameters, poses, readings, rows);
  values = rows.closure;
}

}  // namespace symkin
