// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "symkin/model/chain_info.hpp"
#include "symkin/support/types.hpp"

namespace ceres {
class CostFunction;
}

namespace symkin {

// The closures h(parameters, pose, reading) of one leg at N poses, with their derivatives; psi is
// the reading of the leg's sensor. A row each: k a pose, pose by pose, where the chain has k
// closures.
struct ClosureRows {
  Vector closure;           // k N, metres
  RowMatrix by_parameters;  // k N x p, dh/dparam
  RowMatrix by_pose;        // k N x dof, dh/dpose on the tangent
  Vector by_reading;        // k N, dh/dpsi

  void resize(Index rows, Index parameters, Index dof) {
    closure.resize(rows);
    by_parameters.resize(rows, parameters);
    by_pose.resize(rows, dof);
    by_reading.resize(rows);
  }
};

// Where run time meets compile time: one object per chain, batched operations only, so that no
// loop over poses crosses a virtual call. `poses` holds one pose a row (see PoseSpace).
class LegModel {
 public:
  virtual ~LegModel() = default;

  virtual const ChainInfo& info() const = 0;
  Index parameter_count() const { return static_cast<Index>(info().parameters.size()); }

  // Sensor readings psi at the poses; NaN where the leg cannot reach. An angular joint is read
  // within half a turn of the sensor's zero.
  virtual void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                                  Eigen::Ref<Vector> readings) const = 0;

  // How far the pose is inside the leg's reach, metres; negative outside, infinite if unlimited.
  virtual void reach_margin(ConstVector parameters, ConstRows poses,
                            Eigen::Ref<Vector> margins) const = 0;

  // Readings less others: of an angular joint by the shortest turn.
  virtual void reading_differences(ConstVector parameters, ConstVector readings, ConstVector others,
                                   Eigen::Ref<Vector> differences) const = 0;

  // dq/dpsi at a reading: unit of the active joint per unit of the sensor.
  virtual double sensor_gain(ConstVector parameters, double reading) const = 0;

  // Values and rows as in ClosureRows.
  virtual void closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                       Eigen::Ref<Vector> values) const = 0;

  virtual void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                         ClosureRows& rows) const = 0;

  // The same without by_parameters, which is left as it is: the inner loop of forward kinematics.
  virtual void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                              ClosureRows& rows) const = 0;

  // One cost function a pose on the leg's p parameters, in the pose rows' order.
  // Residuals h(parameters; pose, reading), k of them, in metres; finite beyond the leg's reach.
  virtual std::vector<std::unique_ptr<ceres::CostFunction>> closure_costs(
      ConstRows poses, ConstVector readings) const = 0;
  // Residual g(parameters; pose) - reading (Eq. 15); fails beyond the leg's reach.
  virtual std::vector<std::unique_ptr<ceres::CostFunction>> reading_costs(
      int working_mode, ConstRows poses, ConstVector readings) const = 0;

  // Joint centres in the base frame, base to platform, for drawings: joints x 2 (or 3).
  virtual RowMatrix joint_centres(ConstVector parameters, ConstVector pose,
                                  double reading) const = 0;
};

}  // namespace symkin
