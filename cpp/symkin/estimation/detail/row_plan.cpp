// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/row_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace symkin {
namespace {

using Kind = LatentRows::Kind;

class Planner {
  using Column = Eigen::Ref<const Vector, 0, Eigen::InnerStride<>>;

 public:
  Planner(PoseSpace space, Index count) : space_(space), axes_(to_index(position_size(space))) {
    std::iota(axes_.begin(), axes_.end(), Index{0});
    plan.taken.reserve(to_index(count));
    variances.resize(count, 0);
    values.resize(count, 0);
  }

  // Rows of `observed`, columns from `first` on, that are those components of an observation with
  // the values from there on.
  void add(RowOrigin::Kind kind, Kind how, const Observed& observed, Index first,
           const std::vector<Index>& components, Index place, Index own, Index zero = -1) {
    LatentRows::Observation observation{how, place, own, {-1, -1, -1}, zero};
    for (std::size_t k = 0; k < components.size(); ++k) {
      const Index column = first + static_cast<Index>(k);
      if (add_row({kind, column, 0}, observed.values.col(column),
                  observed.deviations.col(column))) {
        observation.rows[components[k]] = variances.cols() - 1;
      }
    }
    if (std::any_of(observation.rows, observation.rows + 3, [](Index row) { return row >= 0; })) {
      plan.observations.push_back(observation);
    }
  }

  // The same of all coordinates of a point, of angles, or of one number.
  void add_vector(RowOrigin::Kind kind, Kind how, const Observed& observed, Index first,
                  const std::vector<Index>& components, Index own, Index zero = -1) {
    const Index place = room(how == Kind::point || how == Kind::attitude ? 3 : 1);
    const auto size = static_cast<Index>(components.size());
    values.middleCols(place, size) = observed.values.middleCols(first, size);
    add(kind, how, observed, first, components, place, own, zero);
  }

  // Of the coordinates of a point, or of the position of a pose, along axes of their own.
  void add_along(RowOrigin::Kind kind, Kind how, const Observed& observed, Index first, Index axes,
                 Index own) {
    const Index place = room(12);
    const auto size = static_cast<Index>(axes_.size());
    values.middleCols(place, size) =
        observed.values.middleCols(first, size).unaryExpr([](double value) {
          return std::isfinite(value) ? value : 0;
        });
    values.middleCols(place + 3, 9) = observed.axes.middleCols(axes, 9);
    add(kind, how, observed, first, axes_, place, own);
  }

  void add_turns(const Observations& observations) {
    const Index place = room(4);
    values.col(place) = observations.turns.values;
    values.middleCols(place + 1, 3) = observations.turn_axes;
    add(RowOrigin::Kind::turn, Kind::turn, observations.turns, 0, {0}, place, 0);
  }

  // A height, and what its bed's bow comes to by the square of the way from the middle.
  void add_height(const Observed& observed, double by_square, Index own) {
    const Index place = room(2);
    values.col(place) = observed.values.col(0);
    values.col(place + 1).setConstant(by_square);
    add(RowOrigin::Kind::height, Kind::height, observed, 0, {0}, place, own);
  }

  void add_pose(RowOrigin::Kind kind, bool reported, const Observed& observed) {
    if (!observed.any()) {
      return;
    }
    const Index dimensions = position_size(space_);
    const Index turns = observed.values.cols() - dimensions;
    const Index place = room(12);
    // By the components of the tangent: an orientation is there as a whole or not at all.
    Observed tangent{RowMatrix::Zero(observed.values.rows(), degrees_of_freedom(space_)),
                     observed.deviations};
    tangent.values.leftCols(dimensions) = observed.values.leftCols(dimensions);
    Vector known;
    for (Index i = 0; i < observed.values.rows(); ++i) {
      known = observed.values.row(i);
      if (!known.tail(turns).allFinite()) {
        known.tail(turns) = identity_pose(space_).tail(turns);
        tangent.values.row(i)
            .tail(tangent.values.cols() - dimensions)
            .setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      Eigen::Matrix<double, 12, 1> frame;
      write_frame(frame_of_pose(space_, known.data()), frame.data());
      values.row(i).segment<12>(place) = frame;
    }
    std::vector<Index> angles;
    for (const Index slot : pose_slots(space_)) {
      if (slot >= 3) {
        angles.push_back(slot - 3);
      }
    }
    if (observed.axes.cols() > 0) {
      tangent.axes = observed.axes;
      add_along(kind, Kind::position_along, tangent, 0, 0, 0);
    } else {
      add(kind, reported ? Kind::reported_position : Kind::position, tangent, 0, axes_, place, 0);
    }
    add(kind, reported ? Kind::reported_orientation : Kind::orientation, tangent, dimensions,
        angles, place + 3, 0);
  }

  // Whether it was taken anywhere.
  bool add_row(const RowOrigin& origin, const Column& values, const Column& deviations) {
    const auto taken = values.array().isFinite() && deviations.array().isFinite();
    if (origin.kind != RowOrigin::Kind::closure && !taken.any()) {
      return false;
    }
    plan.origins.push_back(origin);
    add_column(taken.select(deviations.cwiseAbs2(), -1));
    return true;
  }

  template <typename Numbers>
  void add_column(const Numbers& column) {
    variances.conservativeResize(Eigen::NoChange, variances.cols() + 1);
    variances.rightCols<1>() = column;
  }

  const std::vector<Index>& axes() const { return axes_; }

  RowPlan plan;  // but for these, which grow by columns
  Eigen::MatrixXd variances, values;

 private:
  static std::size_t to_index(Index i) { return static_cast<std::size_t>(i); }

  Index room(Index count) {
    const Index first = values.cols();
    values.conservativeResize(Eigen::NoChange, first + count);
    values.rightCols(count).setZero();
    return first;
  }

  PoseSpace space_;
  std::vector<Index> axes_;
};

}  // namespace

RowPlan planned_rows(const Mechanism& mechanism, const Observations& observations,
                     const Setup& setup, bool held) {
  const UnknownList list(setup);
  Planner planner(mechanism.pose_space(), observations.count());
  RowPlan& plan = planner.plan;
  // Of a leg that was read, all closures; the further ones bind exactly.
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (Index k = 0; k < mechanism.closures(); ++k) {
      planner.add_row({RowOrigin::Kind::closure, leg, 0}, observations.readings.values.col(leg),
                      observations.readings.deviations.col(leg));
    }
  }
  const Eigen::MatrixXd& variances = planner.variances;
  const Index bound = variances.cols();
  // Where the device measures the robot's own frames, it is as if the robot reported the pose.
  const auto own = [](const Frame& frame) {
    return frame.position.isZero(0) && frame.rotation.isIdentity(0);
  };
  const bool at_rest = observations.base_covariates.cols() == 0;
  planner.add_pose(RowOrigin::Kind::pose, held && at_rest && own(setup.base) && own(setup.target),
                   observations.poses);
  planner.add_pose(RowOrigin::Kind::reported, true, observations.reported);
  const Index dimensions = position_size(mechanism.pose_space());
  const Index scalars = list.point(0);
  for (Index i = 0; observations.points.any() && i < setup.points.rows(); ++i) {
    if (observations.points.axes.cols() > 0) {
      planner.add_along(RowOrigin::Kind::point, Kind::point_along, observations.points,
                        i * dimensions, 9 * i, list.point(i) - scalars);
      continue;
    }
    planner.add_vector(RowOrigin::Kind::point, Kind::point, observations.points, i * dimensions,
                       planner.axes(), list.point(i) - scalars);
  }
  for (Index i = 0; observations.distances.any() && i < setup.anchors.rows(); ++i) {
    planner.add_vector(RowOrigin::Kind::distance, Kind::distance, observations.distances, i, {0},
                       list.anchor(i) - scalars,
                       i < setup.zeros.size() ? list.zero(i) - scalars : -1);
  }
  if (observations.heights.any()) {
    planner.add_height(observations.heights, 1 / (setup.bed_radius * setup.bed_radius),
                       list.plane() - scalars);
  }
  if (observations.attitudes.any()) {
    planner.add_vector(RowOrigin::Kind::attitude, Kind::attitude, observations.attitudes, 0,
                       {0, 1, 2}, 0);
  }
  if (observations.turns.any()) {
    planner.add_turns(observations);
  }
  // A pose that was measured in full everywhere comes first.
  const Index dof = mechanism.dof();
  const auto first = plan.origins.begin() + bound;
  const bool whole =
      variances.cols() >= bound + dof &&
      (first->kind == RowOrigin::Kind::pose || first->kind == RowOrigin::Kind::reported) &&
      std::all_of(first, first + dof, [&](const RowOrigin& origin) {
        return origin.kind == first->kind && origin.index == &origin - &*first;
      });
  if (whole && (variances.middleCols(bound, dof).array() >= 0).all()) {
    plan.basis = bound;
  }
  for (Index i = 0; i < observations.count(); ++i) {
    plan.taken.push_back((variances.row(i).array() >= 0).count());
  }
  while (variances.cols() < dof) {  // the kernels have so many rows all the same
    planner.add_column(Vector::Constant(observations.count(), -1));
    plan.origins.emplace_back();
  }
  plan.variances = variances;
  plan.values = planner.values;
  return std::move(planner.plan);
}

void write_frame(const Frame& frame, double* to) {
  std::copy_n(frame.position.data(), 3, to);
  const Eigen::Matrix3d by_rows = frame.rotation.transpose();
  std::copy_n(by_rows.data(), 9, to + 3);
}

}  // namespace symkin
