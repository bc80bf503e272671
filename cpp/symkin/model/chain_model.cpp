// SPDX-License-Identifier: MIT
#include "symkin/model/chain_model.hpp"

#include <algorithm>

#include "symkin/model/pose_space.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

LegSpan span(const ChainModel::Legs& legs) {
  return {legs.data(), static_cast<Index>(legs.size())};
}

PoseSpan span(ConstRows poses) { return {poses.data(), poses.outerStride(), poses.rows()}; }

// The mode matters to the inverse kinematics alone.
LegValues one_leg(ConstVector parameters, int working_mode = 1) {
  return {parameters.data(), working_mode};
}

}  // namespace

RowMatrix KernelModel::inverse_kinematics(const Legs& legs, ConstRows poses) const {
  RowMatrix readings(poses.rows(), span(legs).count);
  kernels_.inverse(span(legs), span(poses), readings.data());
  return readings;
}

void KernelModel::inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                                     Eigen::Ref<Vector> readings) const {
  const LegValues leg = one_leg(parameters, working_mode);
  kernels_.inverse({&leg, 1}, span(poses), readings.data());
}

RowMatrix KernelModel::reach_margin(const Legs& legs, ConstRows poses) const {
  RowMatrix margins(poses.rows(), span(legs).count);
  kernels_.reach(span(legs), span(poses), margins.data());
  return margins;
}

void KernelModel::reach_margin(ConstVector parameters, ConstRows poses,
                               Eigen::Ref<Vector> margins) const {
  const LegValues leg = one_leg(parameters);
  kernels_.reach({&leg, 1}, span(poses), margins.data());
}

void KernelModel::linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                            ClosureRows& rows) const {
  rows.resize(poses.rows() * info().closures, parameter_count(),
              degrees_of_freedom(info().pose_space));
  kernels_.linearise(parameters.data(), span(poses), readings.data(), rows.closure.data(),
                     rows.by_parameters.data(), rows.by_pose.data(), rows.by_reading.data());
}

void KernelModel::linearise_lanes(const LegLanes& legs, double* rows) const {
  if (legs.lanes == kernels_.lanes) {
    kernels_.linearise_lanes(legs, rows);
  } else {
    LegModel::linearise_lanes(legs, rows);
  }
}

void KernelModel::linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                                 ClosureRows& rows) const {
  const Index count = poses.rows() * info().closures;
  rows.closure.resize(count);
  rows.by_pose.resize(count, degrees_of_freedom(info().pose_space));
  rows.by_reading.resize(count);
  const LegValues leg = one_leg(parameters);
  kernels_.by_pose({&leg, 1}, span(poses), readings.data(), rows.closure.data(),
                   rows.by_pose.data(), rows.by_reading.data());
}

PoseDerivatives KernelModel::linearise_pose(const Legs& legs, ConstRows poses,
                                            const RowMatrix& readings) const {
  const Index columns = span(legs).count * info().closures;
  PoseDerivatives all;
  all.closure.resize(poses.rows(), columns);
  all.by_pose.resize(poses.rows(), columns * degrees_of_freedom(info().pose_space));
  all.by_reading.resize(poses.rows(), columns);
  kernels_.by_pose(span(legs), span(poses), readings.data(), all.closure.data(), all.by_pose.data(),
                   all.by_reading.data());
  return all;
}

void KernelModel::forward_kinematics(const Legs& legs, const RowMatrix& readings, ConstRows start,
                                     const ForwardKinematicsOptions& options, RowMatrix& poses,
                                     std::vector<ForwardStatus>& status) const {
  constexpr Index kBlock = 4096;  // between two looks for an interrupt
  poses.resize(readings.rows(), coordinate_count(info().pose_space));
  status.resize(static_cast<std::size_t>(readings.rows()));
  const Index stride = start.rows() == 1 ? 0 : start.outerStride();
  for (Index first = 0; first < readings.rows(); first += kBlock) {
    check_interrupt();
    const Index count = std::min(kBlock, readings.rows() - first);
    kernels_.forward(span(legs), {start.data() + first * stride, stride, count},
                     readings.row(first).data(), options, poses.row(first).data(),
                     &status[static_cast<std::size_t>(first)]);
  }
}

}  // namespace symkin
