// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>

#include "symkin/chains/declared/declared_model.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/support/error.hpp"

namespace symkin::declared {
namespace {

constexpr double kClosedAtHome = 1e-10;  // m and rad

// Newton's method with whatever rank the columns have on the way.
bool solve(Loops& loops, const Pose& pose, Joints& joints) {
  constexpr int kMost = 60;
  constexpr double kLongest = 0.5;
  for (int i = 0; i < kMost; ++i) {
    loops.walk(pose, joints);
    const Equations residual = loops.residual();
    if (residual.cwiseAbs().maxCoeff() < kClosedAtHome) {
      return loops.on_this_side_of_half_a_turn();
    }
    Eigen::ColPivHouseholderQR<Columns> qr(loops.columns());
    qr.setThreshold(1e-7);
    Joints step = qr.solve(residual);
    const double largest = step.size() > 0 ? step.cwiseAbs().maxCoeff() : 0;
    if (!(largest > 0) || !std::isfinite(largest)) {
      return false;
    }
    joints -= std::min(1.0, kLongest / largest) * step;
  }
  return false;
}

// What is kept before what: link lengths, positions at the base and at the platform, turns there,
// and what is zero of links.
int rank_of(const Scalar& scalar, double drawn) {
  const bool length = scalar.slot == Slot::x || scalar.slot == Slot::y || scalar.slot == Slot::z;
  if (scalar.role.end == End::none) {
    return length && drawn != 0 ? 0 : 5;
  }
  return (length ? 1 : 3) + (scalar.role.end == End::base ? 0 : 1);
}

using Model = std::unique_ptr<const ChainModel>;

// The drawn leg with a straight sensor.
Vector parameters_of(const ChainModel& model, ConstVector geometry) {
  Vector parameters(model.parameter_count());
  parameters << geometry, 1, 1, 0;
  return parameters;
}

// Moves a pose by as little as makes the closures without a reading hold.
void bring_to(const std::vector<Model>& binding, ConstVector geometry, Vector& pose) {
  constexpr int kSteps = 12;
  const auto count = static_cast<Index>(binding.size());
  for (int i = 0; i < kSteps && count > 0; ++i) {
    const RowMatrix at = pose.transpose();
    RowMatrix by_pose(count, 6);
    Vector values(count);
    ClosureRows row;
    for (Index k = 0; k < count; ++k) {
      const ChainModel& model = *binding[static_cast<std::size_t>(k)];
      model.linearise_pose(parameters_of(model, geometry), at, Vector::Zero(1), row);
      by_pose.row(k) = row.by_pose;
      values[k] = row.closure[0];
    }
    const Vector step = -by_pose.transpose() * (by_pose * by_pose.transpose()).ldlt().solve(values);
    move_pose(PoseSpace::spatial, step.data(), pose.data());
  }
}

// Poses near home at which the leg closes. A leg that binds the platform leaves it the coordinates
// that can be chosen.
std::vector<Vector> poses_near(const Declaration& declaration, const ChainModel& model,
                               const std::vector<Model>& binding, ConstVector geometry) {
  constexpr int kPoses = 60;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(-1, 1);
  const PoseSpace space = declaration.pose_space;
  const Index position = position_size(space);
  double reach = 0;
  for (const TransformValues& each : declaration.leg.transforms) {
    reach = std::max({reach, std::abs(each[1]), std::abs(each[2]), std::abs(each[3])});
  }
  const std::vector<Index> free = free_coordinates(model.info());
  std::vector<Vector> poses;
  for (int i = 0; i < 20 * kPoses && static_cast<int>(poses.size()) < kPoses; ++i) {
    Vector step = Vector::Zero(degrees_of_freedom(space));
    for (const Index k : free) {
      step[k] = share(random) * (k < position ? 0.15 * std::max(reach, 1e-3) : 0.25);
    }
    Vector pose = declaration.home_pose;
    move_pose(space, step.data(), pose.data());
    bring_to(binding, geometry, pose);
    Vector reading(1);
    const RowMatrix row = pose.transpose();
    model.inverse_kinematics(parameters_of(model, geometry), 1, row, reading);
    if (reading.allFinite()) {
      poses.push_back(pose);
    }
  }
  return poses;
}

// Derivatives of the leg's closures by its parameters at such poses.
RowMatrix rows_near(const Declaration& declaration, const std::vector<Model>& binding,
                    ConstVector geometry) {
  const auto model = declared_model(declaration);
  const Vector parameters = parameters_of(*model, geometry);
  const std::vector<Vector> near = poses_near(declaration, *model, binding, geometry);
  RowMatrix poses(static_cast<Index>(near.size()), declaration.home_pose.size());
  for (std::size_t i = 0; i < near.size(); ++i) {
    poses.row(static_cast<Index>(i)) = near[i].transpose();
  }
  Vector readings(poses.rows());
  model->inverse_kinematics(parameters, 1, poses, readings);
  ClosureRows rows;
  model->linearise(parameters, poses, readings, rows);
  return rows.by_parameters;
}

}  // namespace

Vector joints_at_home(const Description& leg, const Pose& pose, ConstVector start,
                      const std::vector<bool>& known) {
  constexpr int kTries = 200;
  constexpr double kNear = 0.2;  // m and rad: what is given is rounded
  Loops loops(leg);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-3.14, 3.14);
  for (int i = 0; i < kTries; ++i) {
    Joints joints = start;
    for (Index k = 0; i > 0 && k < joints.size(); ++k) {
      const bool turns =
          leg.joints[static_cast<std::size_t>(loops.own()[static_cast<std::size_t>(k)])].kind ==
          JointKind::turn;
      if (!known[static_cast<std::size_t>(k)]) {
        joints[k] += turns ? angle(random) : angle(random) / 3;
      }
    }
    if (!solve(loops, pose, joints)) {
      continue;
    }
    bool near = true;
    for (Index k = 0; k < joints.size(); ++k) {
      near =
          near && (!known[static_cast<std::size_t>(k)] || std::abs(joints[k] - start[k]) < kNear);
      if (leg.joints[static_cast<std::size_t>(loops.own()[static_cast<std::size_t>(k)])].kind ==
              JointKind::turn &&
          !known[static_cast<std::size_t>(k)]) {
        joints[k] = std::remainder(joints[k], 2 * kPi);
      }
    }
    if (near) {
      return joints;
    }
  }
  throw InvalidInput("no joint values near those of home close the leg at the pose home");
}

RowMatrix joints_at(const Declaration& declaration, ConstVector parameters, ConstRows poses) {
  const Description& drawn = declaration.leg;
  const auto wanted = static_cast<Index>(drawn.scalars.size()) + 1;
  const Index coordinates = declaration.home_pose.size();
  if (parameters.size() != wanted || poses.cols() != coordinates) {
    throw InvalidInput("there are " + std::to_string(parameters.size()) + " parameters and " +
                       std::to_string(poses.cols()) + " coordinates of poses; expected " +
                       std::to_string(wanted) + " and " + std::to_string(coordinates));
  }
  if (!parameters.allFinite() || !poses.allFinite()) {
    throw InvalidInput("parameters or poses are not finite");
  }
  Assembly leg(drawn, {pose_of(declaration.pose_space, declaration.home_pose.data()),
                       declaration.home_joints});
  leg.set_leg(parameters.head(wanted - 1), parameters[wanted - 1] < 0);
  RowMatrix all = RowMatrix::Constant(poses.rows(), declaration.home_joints.size(),
                                      std::numeric_limits<double>::quiet_NaN());
  Joints joints;
  for (Index i = 0; i < poses.rows(); ++i) {
    if (leg.close(pose_of(declaration.pose_space, poses.row(i).data()), joints)) {
      all.row(i) = joints.transpose();
    }
  }
  return all;
}

std::vector<bool> redundant_scalars(const std::vector<Declaration>& readings) {
  constexpr double kAdds = 1e-9;  // of itself
  if (readings.empty()) {
    throw InvalidInput("a leg without a closure; expected one or more");
  }
  const Description& drawn = readings.front().leg;
  const std::vector<Scalar>& scalars = drawn.scalars;
  const auto count = static_cast<Index>(scalars.size());
  Vector geometry(count);
  for (Index i = 0; i < count; ++i) {
    const Scalar& scalar = scalars[static_cast<std::size_t>(i)];
    geometry[i] = drawn.transforms[static_cast<std::size_t>(scalar.transform)]
                                  [static_cast<std::size_t>(scalar.slot)];
  }
  // What is drawn, then gain and offset of each sensor: sensors show themselves in rows of their
  // own.
  const auto is_read = [](const Declaration& each) {
    return std::any_of(each.leg.joints.begin(), each.leg.joints.end(),
                       [](const Joint& joint) { return joint.read; });
  };
  const auto sensors = static_cast<Index>(std::count_if(readings.begin(), readings.end(), is_read));
  std::vector<Model> binding;
  for (const Declaration& each : readings) {
    if (!is_read(each)) {
      binding.push_back(declared_model(each));
    }
  }
  RowMatrix columns(0, count + 2 * sensors);
  Index sensor = 0;
  for (const Declaration& each : readings) {
    const RowMatrix own = rows_near(each, binding, geometry);
    const Index first = columns.rows();
    columns.conservativeResize(first + own.rows(), Eigen::NoChange);
    columns.bottomRows(own.rows()).setZero();
    columns.block(first, 0, own.rows(), count) = own.leftCols(count);
    if (is_read(each)) {
      columns.block(first, count + 2 * sensor++, own.rows(), 2) = own.rightCols<2>();
    }
  }
  std::vector<Index> order(scalars.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return rank_of(scalars[static_cast<std::size_t>(a)], geometry[a]) <
           rank_of(scalars[static_cast<std::size_t>(b)], geometry[b]);
  });
  // One after the other, sensors first, by what is left of it beside those before.
  for (Index i = 2 * sensors; i-- > 0;) {
    order.insert(order.begin(), count + i);
  }
  std::vector<Vector> kept;
  std::vector<bool> held(scalars.size(), false);
  for (const Index each : order) {
    const bool of_sensor = each >= count;
    if (!of_sensor && (scalars[static_cast<std::size_t>(each)].held ||
                       is_constant(scalars[static_cast<std::size_t>(each)].role.kind))) {
      continue;
    }
    const Vector column = columns.col(each);
    Vector left = column;
    for (int twice = 0; twice < 2; ++twice) {
      for (const Vector& other : kept) {
        left -= other.dot(left) * other;
      }
    }
    if (left.norm() > kAdds * column.norm() && column.norm() > 1e-12) {
      kept.push_back(left.normalized());
    } else if (!of_sensor) {
      held[static_cast<std::size_t>(each)] = true;
    }
  }
  return held;
}

}  // namespace symkin::declared
