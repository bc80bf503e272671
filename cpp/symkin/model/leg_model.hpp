// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>

#include "symkin/model/chain_info.hpp"
#include "symkin/model/leg_kernels.hpp"
#include "symkin/support/types.hpp"

namespace ceres {
class CostFunction;
}  // namespace ceres

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

  // Takes the reading out of all closures of a leg but the first, by their combination with the
  // first: what is left of them, h_c - (g_c / g_1) h_1 with g = dh/dpsi, binds the pose alone.
  void eliminate_reading(Index closures);
};

// The same of all legs: a row a pose, in it k columns (dof k in by_pose) a leg.
struct PoseDerivatives {
  RowMatrix closure, by_pose, by_reading;

  void eliminate_reading(Index closures);  // as ClosureRows does
};

// What is asked of one leg, at all poses at once, so that no loop over poses crosses a call.
// `poses` holds one pose a row (see PoseSpace). Results for a pose depend on nothing but that pose:
// not on its neighbours, nor on the processor.
class LegModel {
 public:
  virtual ~LegModel() = default;

  const ChainInfo& info() const { return info_; }
  Index parameter_count() const { return static_cast<Index>(info_.parameters.size()); }

  // Sensor readings psi at the poses; NaN where the leg cannot reach. An angular joint is read
  // within half a turn of the sensor's zero.
  virtual void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                                  Eigen::Ref<Vector> readings) const = 0;

  // How far the pose is inside the leg's reach, metres; negative outside, infinite if unlimited.
  virtual void reach_margin(ConstVector parameters, ConstRows poses,
                            Eigen::Ref<Vector> margins) const = 0;

  // Values and rows as in ClosureRows.
  void closure(ConstVector parameters, ConstRows poses, ConstVector readings,
               Eigen::Ref<Vector> values) const;
  virtual void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                         ClosureRows& rows) const = 0;
  // The same of legs side by side: of every closure a row of h, dh/dparam (p), dh/dpose (dof) and
  // dh/dpsi, of each of these numbers those of all lanes one behind the other.
  virtual void linearise_lanes(const LegLanes& legs, double* rows) const;
  // The same without by_parameters, which is left as it is.
  virtual void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                              ClosureRows& rows) const = 0;

  // The closures for a problem of your own in Ceres, with the blocks of LegConstraint; valid as
  // long as the model.
  std::unique_ptr<ceres::CostFunction> constraint() const;

  // Readings less others: of an angular joint by the shortest turn.
  virtual void reading_differences(ConstVector parameters, ConstVector readings, ConstVector others,
                                   Eigen::Ref<Vector> differences) const = 0;

  // dq/dpsi at a reading: unit of the active joint per unit of the sensor.
  virtual double sensor_gain(ConstVector parameters, double reading) const = 0;

  // Joint centres in the base frame, base to platform, for drawings: joints x 2 (or 3). Of a
  // spherical leg, the joints' axes where they leave the unit sphere.
  virtual RowMatrix joint_centres(ConstVector parameters, ConstVector pose,
                                  double reading) const = 0;

 protected:
  explicit LegModel(ChainInfo info) : info_(std::move(info)) {}

 private:
  ChainInfo info_;
};

}  // namespace symkin
