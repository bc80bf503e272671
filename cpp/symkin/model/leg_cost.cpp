// SPDX-License-Identifier: MIT
#include <ceres/cost_function.h>

#include "symkin/model/leg_model.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {
namespace {

// The rows of one leg at one pose as Ceres asks for them.
class LegCost final : public ceres::CostFunction {
 public:
  explicit LegCost(const LegModel& model) : model_(model) {
    set_num_residuals(static_cast<int>(model.info().closures));
    *mutable_parameter_block_sizes() = {static_cast<int>(model.parameter_count()),
                                        static_cast<int>(coordinate_count(space())), 1};
  }

  bool Evaluate(const double* const* blocks, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector> parameters(blocks[0], model_.parameter_count());
    const Eigen::Map<const RowMatrix> pose(blocks[1], 1, coordinate_count(space()));
    const Eigen::Map<const Vector> reading(blocks[2], 1);
    ClosureRows rows;
    model_.linearise(parameters, pose, reading, rows);
    const auto write = [](const auto& from, double* to) {
      if (to != nullptr) {
        Eigen::Map<RowMatrix>(to, from.rows(), from.cols()) = from;
      }
    };
    write(rows.closure, residuals);
    if (jacobians != nullptr) {
      write(rows.by_parameters, jacobians[0]);
      write(by_coordinates(rows.by_pose, pose), jacobians[1]);
      write(rows.by_reading, jacobians[2]);
    }
    return rows.closure.allFinite();
  }

 private:
  PoseSpace space() const { return model_.info().pose_space; }

  // From the tangent w to the quaternion q: dq/dw = 0.5 [w] q has orthogonal columns of half its
  // length, and along q itself a rotation does not change.
  RowMatrix by_coordinates(const RowMatrix& by_tangent,
                           const Eigen::Map<const RowMatrix>& pose) const {
    if (!has_quaternion(space())) {
      return by_tangent;
    }
    const Index position = position_size(space());
    const double* q = pose.data() + position;
    Eigen::Matrix<double, 3, 4> turn;  // (dq/dw)' times 4 / |q|^2
    turn << q[3], -q[2], q[1], -q[0],  //
        q[2], q[3], -q[0], -q[1],      //
        -q[1], q[0], q[3], -q[2];
    turn *= 2 / Eigen::Map<const Eigen::Vector4d>(q).squaredNorm();
    RowMatrix rows(by_tangent.rows(), position + 4);
    rows.leftCols(position) = by_tangent.leftCols(position);
    rows.rightCols(4) = by_tangent.rightCols(3) * turn;
    return rows;
  }

  const LegModel& model_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> LegModel::constraint() const {
  return std::make_unique<LegCost>(*this);
}

}  // namespace symkin
