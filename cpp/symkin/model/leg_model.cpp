// SPDX-License-Identifier: MIT
#include "symkin/model/leg_model.hpp"

#include <algorithm>
#include <initializer_list>

#include "symkin/model/pose_space.hpp"

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

void LegModel::linearise_lanes(const LegLanes& legs, double* rows) const {
  using Lane = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>, 0,
                          Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;
  const Index p = parameter_count();
  const Index dof = degrees_of_freedom(info_.pose_space);
  const Index width = p + dof + 2;
  ClosureRows own;
  for (Index lane = 0; lane < legs.lanes; ++lane) {
    const auto of_lane = [&](const double* first, Index count, Index columns) {
      return Lane(first + lane, count, columns, {legs.lanes, columns * legs.lanes});
    };
    const Vector parameters = of_lane(legs.parameters, p, 1);
    const RowMatrix poses = of_lane(legs.poses, legs.count, coordinate_count(info_.pose_space));
    const Vector readings = of_lane(legs.readings, legs.count, 1);
    linearise(parameters, poses, readings, own);
    RowMatrix all(own.closure.size(), width);
    all << own.closure, own.by_parameters, own.by_pose, own.by_reading;
    for (Index i = 0; i < all.size(); ++i) {
      rows[i * legs.lanes + lane] = all.data()[i];
    }
  }
}

// Asked for too seldom for a kernel of its own.
void LegModel::closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                       Eigen::Ref<Vector> values) const {
  ClosureRows rows;
  linearise_pose(parameters, poses, readings, rows);
  values = rows.closure;
}

}  // namespace symkin
