// SPDX-License-Identifier: MIT
#include "symkin/kinematics/inverse_kinematics.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "symkin/support/error.hpp"
#include "symkin/support/scale_rows.hpp"

namespace symkin {
namespace {

Vector leg_readings(const Mechanism& mechanism, Index leg, ConstRows poses) {
  Vector readings(poses.rows());
  const Leg& which = mechanism.leg(leg);
  mechanism.model().inverse_kinematics(which.parameters, which.working_mode, poses, readings);
  return readings;
}

// Eigenvalues of J'J, ascending. The closed form of Eigen for 2 and 3 columns is accurate enough
// for a condition number of some thousands, and twenty times faster than a decomposition.
template <int Dof>
Eigen::Matrix<double, Dof, 1> gram_eigenvalues(const Eigen::Matrix<double, Dof, Dof>& gram) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Dof, Dof>> solver;
  if constexpr (Dof <= 3) {
    solver.computeDirect(gram, Eigen::EigenvaluesOnly);
  } else {
    solver.compute(gram, Eigen::EigenvaluesOnly);
  }
  return solver.eigenvalues();
}

template <int Dof>
double condition(const double* jacobian, ConstVector gains, Index position, double length) {
  // The lower triangle, which is all that the solver reads.
  Eigen::Matrix<double, Dof, Dof> gram = Eigen::Matrix<double, Dof, Dof>::Zero();
  for (Index leg = 0; leg < gains.size(); ++leg) {
    const double scale = gains[leg] / gains[0];
    double row[Dof];
    for (Index i = 0; i < Dof; ++i) {
      row[i] = jacobian[leg * Dof + i] * (i < position ? scale : scale / length);
      for (Index k = 0; k <= i; ++k) {
        gram(i, k) += row[i] * row[k];
      }
    }
  }
  if (!gram.allFinite()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto eigenvalues = gram_eigenvalues<Dof>(gram);
  return eigenvalues[0] > 0 ? std::sqrt(eigenvalues[Dof - 1] / eigenvalues[0])
                            : std::numeric_limits<double>::infinity();
}

template <int Dof>
double determinant(const double* jacobian, Index legs) {
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Dof, Eigen::RowMajor>;
  const Eigen::Map<const Jacobian> rows(jacobian, legs, Dof);
  if (legs == Dof) {
    return Eigen::Matrix<double, Dof, Dof>(rows).determinant();
  }
  const Eigen::Matrix<double, Dof, Dof> gram = rows.transpose() * rows;
  return std::sqrt(std::max(0.0, gram.determinant()));
}

PoseDerivatives linearise_all(const Mechanism& mechanism, ConstRows poses, ConstRows readings) {
  check_one_closure(mechanism.model().info(), "the Jacobian of the readings by the pose");
  check_poses(mechanism, poses);
  check_readings(mechanism, poses.rows(), readings);
  return mechanism.model().linearise_pose(mechanism.leg_values(), poses, readings);
}

// Implicit function theorem: dg/dpose = -(dh/dpose) / (dh/dpsi).
RowMatrix by_readings(PoseDerivatives all) {
  const Index dof = all.by_pose.cols() / std::max<Index>(all.by_reading.cols(), 1);
  double* element = all.by_pose.data();
  for (Index i = 0; i < all.by_reading.size(); ++i) {
    const double factor = -1 / all.by_reading.data()[i];
    for (Index k = 0; k < dof; ++k) {
      *element++ *= factor;
    }
  }
  return std::move(all.by_pose);
}

}  // namespace

RowMatrix inverse_kinematics(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  return mechanism.model().inverse_kinematics(mechanism.leg_values(), poses);
}

RowMatrix reach_margin(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  return mechanism.model().reach_margin(mechanism.leg_values(), poses);
}

Vector closure(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings) {
  check_poses(mechanism, poses);
  check_leg_readings(poses.rows(), readings);
  Vector values(poses.rows() * mechanism.model().info().closures);
  mechanism.model().closure(mechanism.leg(leg).parameters, poses, readings, values);
  return values;
}

ClosureRows linearise(const Mechanism& mechanism, Index leg, ConstRows poses,
                      ConstVector readings) {
  check_poses(mechanism, poses);
  check_leg_readings(poses.rows(), readings);
  ClosureRows rows;
  mechanism.model().linearise(mechanism.leg(leg).parameters, poses, readings, rows);
  return rows;
}

RowMatrix parameter_jacobian(const Mechanism& mechanism, Index leg, ConstRows poses) {
  check_one_closure(mechanism.model().info(), "the Jacobian of the readings by the parameters");
  check_poses(mechanism, poses);
  ClosureRows rows = linearise(mechanism, leg, poses, leg_readings(mechanism, leg, poses));
  // dg/dparam = -(dh/dparam) / (dh/dpsi).
  scale_rows(rows.by_parameters, -rows.by_reading.cwiseInverse());
  return std::move(rows.by_parameters);
}

RowMatrix pose_jacobian(const Mechanism& mechanism, ConstRows poses) {
  return pose_jacobian_at(mechanism, poses, inverse_kinematics(mechanism, poses));
}

RowMatrix pose_jacobian_at(const Mechanism& mechanism, ConstRows poses, ConstRows readings) {
  return by_readings(linearise_all(mechanism, poses, readings));
}

Vector sensor_gains(const Mechanism& mechanism) {
  Vector gains(mechanism.leg_count());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    gains[leg] = mechanism.model().sensor_gain(mechanism.leg(leg).parameters, 0);
  }
  return gains;
}

SingularityMeasures singularity_measures(const Mechanism& mechanism, ConstRows poses,
                                         double characteristic_length) {
  if (!(characteristic_length > 0)) {
    throw InvalidInput("characteristic_length = " + std::to_string(characteristic_length) +
                       " m; expected a positive length");
  }
  const Index legs = mechanism.leg_count();
  PoseDerivatives all = linearise_all(mechanism, poses, inverse_kinematics(mechanism, poses));
  SingularityMeasures measures;
  measures.serial = all.by_reading;
  const RowMatrix jacobian = by_readings(std::move(all));
  measures.parallel.resize(poses.rows());
  measures.condition.resize(poses.rows());
  const Vector gains = sensor_gains(mechanism);
  measures.serial.array().rowwise() /= gains.transpose().array();
  for (Index i = 0; i < poses.rows(); ++i) {
    const double* row = jacobian.row(i).data();
    measures.parallel[i] = pose_determinant(row, legs, mechanism.dof());
    measures.condition[i] =
        pose_condition(row, gains, mechanism.pose_space(), characteristic_length);
  }
  return measures;
}

double pose_condition(const double* jacobian, ConstVector gains, PoseSpace space,
                      double characteristic_length) {
  const Index position = position_size(space);
  switch (degrees_of_freedom(space)) {
    case 2:
      return condition<2>(jacobian, gains, position, characteristic_length);
    case 3:
      return condition<3>(jacobian, gains, position, characteristic_length);
    default:
      return condition<6>(jacobian, gains, position, characteristic_length);
  }
}

double pose_determinant(const double* jacobian, Index legs, Index dof) {
  switch (dof) {
    case 2:
      return determinant<2>(jacobian, legs);
    case 3:
      return determinant<3>(jacobian, legs);
    default:
      return determinant<6>(jacobian, legs);
  }
}

}  // namespace symkin
