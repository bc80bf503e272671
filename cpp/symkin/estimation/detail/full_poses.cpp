// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/full_poses.hpp"

#include <algorithm>
#include <cmath>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

bool equal(const double* values, Index count) {
  return std::all_of(values, values + count, [&](double value) { return value == values[0]; });
}

bool free_frame(const Layout& layout, Index first) {
  const auto begin = layout.column.begin() + first;
  return std::any_of(begin, begin + 6, [](Index column) { return column >= 0; });
}

}  // namespace

FullPoses::FullPoses(const Mechanism& mechanism, const Observations& observations,
                     const Layout& layout, const Setup& setup)
    : mechanism_(mechanism),
      layout_(layout),
      list_(setup),
      legs_(mechanism.leg_count()),
      taken_(static_cast<std::size_t>(observations.count()), false),
      legs_read_(taken_.size(), 0) {
  const PoseSpace space = mechanism.pose_space();
  const Observed& poses = observations.poses;
  if (space == PoseSpace::spherical || !poses.any() || observations.reported.any() ||
      observations.points.any() || observations.distances.any() || observations.heights.any() ||
      mechanism.closures() != 1 || legs_ > FullPoseKernels::kMostLegs ||
      free_frame(layout, list_.base()) || free_frame(layout, list_.target())) {
    return;
  }
  // The closed form has the errors of position and of orientation apart.
  if (has_orientation(space) && !setup.target.position.isZero(0)) {
    return;
  }
  const Index count = observations.count();
  to_device_ = setup.base.rotation;
  const Frame from_device = setup.base.inverse();
  const Frame to_platform = setup.target.inverse();
  const bool turned = !setup.base.rotation.isIdentity(0);
  const Index position = position_size(space);
  measured_ = poses.values;
  for (Index i = 0; i < count; ++i) {
    const double* deviations = poses.deviations.row(i).data();
    // Deviations are those of the device's axes.
    if (!poses.values.row(i).allFinite() ||
        (turned && !(equal(deviations, position) &&
                     equal(deviations + position, mechanism.dof() - position)))) {
      continue;
    }
    taken_[static_cast<std::size_t>(i)] = true;
    legs_read_[static_cast<std::size_t>(i)] =
        observations.readings.values.row(i).array().isFinite().count();
    pose_of_frame(space,
                  from_device * frame_of_pose(space, poses.values.row(i).data()) * to_platform,
                  measured_.row(i).data());
  }
  pose_variances_ = poses.deviations.cwiseAbs2();
  const auto read = observations.readings.values.array().isFinite();
  unread_ = (!read).cast<double>();
  reading_variances_ = read.select(observations.readings.deviations.cwiseAbs2(), 0);
  precisions_.resize(count, legs_ * (legs_ + 1) / 2);
  multipliers_.resize(count, legs_);
  misfits_.resize(count, mechanism.dof());
  if (space == PoseSpace::spatial) {
    turns_.resize(count, 9);
  }
  chi_squares_.resize(count);
  pivots_.resize(count);
  of_legs_.resize(static_cast<std::size_t>(legs_));
}

FullPoseRows FullPoses::rows(const State& state) {
  for (std::size_t leg = 0; leg < of_legs_.size(); ++leg) {
    const ClosureRows& rows = state.legs[leg];
    of_legs_[leg] = {rows.closure.data(), rows.by_parameters.data(), rows.by_pose.data(),
                     rows.by_reading.data()};
  }
  return {state.poses.rows(),
          legs_,
          mechanism_.dof(),
          state.legs.front().by_parameters.cols(),
          of_legs_.data(),
          state.errors.data(),
          reading_variances_.data(),
          unread_.data(),
          pose_variances_.data(),
          misfits_.data(),
          turns_.data(),
          precisions_.data(),
          multipliers_.data(),
          chi_squares_.data(),
          pivots_.data()};
}

void FullPoses::eliminate(const State& state) {
  const PoseSpace space = mechanism_.pose_space();
  for (Index i = 0; i < state.poses.rows(); ++i) {
    double* misfit = misfits_.row(i).data();
    pose_difference(space, state.poses.row(i).data(), measured_.row(i).data(), misfit);
    if (turns_.size() > 0) {
      Eigen::Map<Eigen::Matrix3d>(turns_.row(i).data()) =
          left_jacobian(Eigen::Map<const Eigen::Vector3d>(misfit + 3));
    }
  }
  full_pose_kernels().eliminate(rows(state));
}

std::vector<Index> FullPoses::columns(Index width) const {
  std::vector<Index> columns;
  for (Index leg = 0; leg < legs_; ++leg) {
    const auto first = layout_.column.begin() + list_.leg(leg);
    columns.insert(columns.end(), first, first + width);
  }
  return columns;
}

bool FullPoses::eliminated(Index pose) const {
  constexpr double kSingular = 1e-10;  // of a variance: what is left once the other legs are known
  return takes(pose) && pivots_[pose] > kSingular;
}

void FullPoses::add_to(NormalEquations& equations, const State& state, const Vector& weights,
                       const std::vector<Index>& poses) {
  // In the legs' own scalars first, a block a pair of legs: every pose adds to the same few.
  const Index width = state.legs.front().by_parameters.cols();
  const Index size = legs_ * width;
  information_.setZero(size, size);
  gradient_.setZero(size);
  full_pose_kernels().add(rows(state), poses.data(), static_cast<Index>(poses.size()),
                          weights.data(), information_.data(), gradient_.data());
  const std::vector<Index> columns = this->columns(width);
  for (Index i = 0; i < size; ++i) {
    const Index row = columns[static_cast<std::size_t>(i)];
    if (row < 0) {
      continue;
    }
    equations.gradient[row] += gradient_[i];
    // Blocks of a pair of legs were added once, those of one leg in full.
    const Index first_of_leg = i / width * width;
    for (Index j = 0; j < first_of_leg + width; ++j) {
      const Index column = columns[static_cast<std::size_t>(j)];
      if (column < 0) {
        continue;
      }
      equations.information(row, column) += information_(i, j);
      if (j < first_of_leg) {
        equations.information(column, row) += information_(i, j);
      }
    }
  }
}

void FullPoses::move(const State& state, const Vector& d, Moves& moves) {
  const Index count = state.poses.rows();
  const Index width = state.legs.front().by_parameters.cols();
  effects_.resize(count, legs_);
  Vector of_leg(width);
  for (Index leg = 0; leg < legs_; ++leg) {
    for (Index s = 0; s < width; ++s) {
      const Index column = layout_.column[static_cast<std::size_t>(list_.leg(leg) + s)];
      of_leg[s] = column < 0 ? 0 : d[column];
    }
    effects_.col(leg).noalias() = state.legs[static_cast<std::size_t>(leg)].by_parameters * of_leg;
  }
  moves.tangents.resize(count, mechanism_.dof());
  moves.errors.resize(count, legs_);
  full_pose_kernels().move(rows(state), effects_.data(), moves.tangents.data(),
                           moves.errors.data());
}

RowMatrix FullPoses::own_covariance(const RowMatrix& covariance, Index width) const {
  const std::vector<Index> columns = this->columns(width);
  const auto size = static_cast<Index>(columns.size());
  RowMatrix own = RowMatrix::Zero(size, size);
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < size; ++j) {
      const Index row = columns[static_cast<std::size_t>(i)];
      const Index column = columns[static_cast<std::size_t>(j)];
      own(i, j) = row < 0 || column < 0 ? 0 : covariance(row, column);
    }
  }
  return own;
}

PoseRows FullPoses::rows_of(const State& state, Index pose, const RowMatrix& own) const {
  const Index dof = mechanism_.dof();
  const Index position = position_size(mechanism_.pose_space());
  PoseRows rows;
  RowMatrix h(legs_, dof);            // on the tangent of the measured pose, in the device's axes
  RowMatrix explained(legs_, legs_);  // of the conditions' covariance, by the estimate: J C J'
  rows.precision.resize(legs_, legs_);
  for (Index leg = 0; leg < legs_; ++leg) {
    const ClosureRows& of_leg = state.legs[static_cast<std::size_t>(leg)];
    h.row(leg) = of_leg.by_pose.row(pose);
    const Index width = of_leg.by_parameters.cols();
    const Eigen::RowVectorXd by_own =
        of_leg.by_parameters.row(pose) * own.middleRows(leg * width, width);
    for (Index other = 0; other <= leg; ++other) {
      rows.precision(leg, other) = rows.precision(other, leg) =
          precisions_(pose, leg * (leg + 1) / 2 + other);
      explained(leg, other) = explained(other, leg) =
          by_own.segment(other * width, width)
              .dot(state.legs[static_cast<std::size_t>(other)].by_parameters.row(pose));
    }
  }
  if (turns_.size() > 0) {
    h.rightCols<3>() *= Eigen::Map<const Eigen::Matrix3d>(turns_.row(pose).data());
    h.rightCols<3>() *= to_device_.transpose();
  }
  h.leftCols(position) *= to_device_.topLeftCorner(position, position).transpose();
  const Index count = this->count(pose);
  rows.conditions.setZero(count + dof, legs_);
  rows.conditions.bottomRows(dof) = -h.transpose();
  rows.variances.resize(count + dof);
  rows.variances.tail(dof) = pose_variances_.row(pose);
  for (Index leg = 0; leg < legs_; ++leg) {
    if (unread_(pose, leg) == 0) {
      const auto k = static_cast<Index>(rows.origins.size());
      const double g = state.legs[static_cast<std::size_t>(leg)].by_reading[pose];
      rows.origins.push_back({RowOrigin::Kind::closure, leg, g});
      rows.variances[k] = g * g * reading_variances_(pose, leg);
      rows.conditions(k, leg) = 1;
    }
  }
  for (Index k = 0; k < dof; ++k) {
    rows.origins.push_back({RowOrigin::Kind::pose, k, 0});
  }
  rows.multipliers = multipliers_.row(pose);
  rows.left = rows.precision - product(product(rows.precision, explained), rows.precision);
  return rows;
}

}  // namespace symkin
