// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include "symkin/model/leg_kernels.hpp"
#include "symkin/model/leg_model.hpp"

namespace symkin {

// Where run time meets compile time: one object per chain, with the loops over poses of one leg and
// of all legs of a mechanism whose legs are of this chain alone.
class ChainModel : public LegModel {
 public:
  using Legs = std::vector<LegValues>;

  using LegModel::inverse_kinematics;
  using LegModel::linearise_pose;
  using LegModel::reach_margin;

  // What LegModel is asked of one leg, of all legs: readings and margins N x legs.
  virtual RowMatrix inverse_kinematics(const Legs& legs, ConstRows poses) const = 0;
  virtual RowMatrix reach_margin(const Legs& legs, ConstRows poses) const = 0;
  virtual PoseDerivatives linearise_pose(const Legs& legs, ConstRows poses,
                                         const RowMatrix& readings) const = 0;

  // See forward_kinematics(): the poses and how they ended, for a row of readings each; `start` is
  // as many poses, or one.
  virtual void forward_kinematics(const Legs& legs, const RowMatrix& readings, ConstRows start,
                                  const ForwardKinematicsOptions& options, RowMatrix& poses,
                                  std::vector<ForwardStatus>& status) const = 0;

 protected:
  using LegModel::LegModel;
};

// A chain with kernels.
class KernelModel : public ChainModel {
 public:
  void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                          Eigen::Ref<Vector> readings) const final;
  void reach_margin(ConstVector parameters, ConstRows poses,
                    Eigen::Ref<Vector> margins) const final;
  void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                 ClosureRows& rows) const final;
  void linearise_lanes(const LegLanes& legs, double* rows) const final;
  void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                      ClosureRows& rows) const final;

  RowMatrix inverse_kinematics(const Legs& legs, ConstRows poses) const final;
  RowMatrix reach_margin(const Legs& legs, ConstRows poses) const final;
  PoseDerivatives linearise_pose(const Legs& legs, ConstRows poses,
                                 const RowMatrix& readings) const final;
  void forward_kinematics(const Legs& legs, const RowMatrix& readings, ConstRows start,
                          const ForwardKinematicsOptions& options, RowMatrix& poses,
                          std::vector<ForwardStatus>& status) const final;

 protected:
  KernelModel(ChainInfo info, const LegKernels& kernels)
      : ChainModel(std::move(info)), kernels_(kernels) {}

 private:
  LegKernels kernels_;
};

}  // namespace symkin
