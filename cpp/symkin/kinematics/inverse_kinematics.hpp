// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// Sensor readings at the poses, N x legs, in the legs' working modes; NaN where a leg cannot reach.
// Those of angular joints are within half a turn of the leg's home reading.
RowMatrix inverse_kinematics(const Mechanism& mechanism, ConstRows poses);
// The same of one leg.
Vector inverse_kinematics(const Mechanism& mechanism, Index leg, ConstRows poses);

// The mechanism with the home readings that its legs have at a pose, between -160 and 200 degrees
// of the joint; zero where one cannot reach.
Mechanism counted_from(const Mechanism& mechanism, ConstVector home);

// How far each leg is from the end of its reach, metres, N x legs; negative outside.
RowMatrix reach_margin(const Mechanism& mechanism, ConstRows poses);

// h of one leg, metres, k N where a leg has k closures. Readings of that leg, one a pose
// (InvalidInput otherwise).
Vector closure(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings);

// The closure of one leg with all its derivatives.
ClosureRows linearise(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings);

// Closures of all legs with their derivatives but those by parameters; readings N x legs.
PoseDerivatives linearise_pose(const Mechanism& mechanism, ConstRows poses,
                               const RowMatrix& readings);

// dg/dparam of one leg at its inverse kinematics, N x p: the rows of the paper's identification
// matrix C (Eqs. 8, 11). NaN where the leg cannot reach.
RowMatrix parameter_jacobian(const Mechanism& mechanism, Index leg, ConstRows poses);

// dg/dpose of all legs at the inverse kinematics, N x (legs * dof), leg by leg.
RowMatrix pose_jacobian(const Mechanism& mechanism, ConstRows poses);

// The same at given readings, N x legs, with the rows of what else binds the platform behind each
// leg's: N x (legs * k * dof) where a leg has k closures, of which the others, without the reading
// (see ClosureRows::eliminate_reading), are in metres.
RowMatrix closed_pose_jacobian(const Mechanism& mechanism, ConstRows poses, ConstRows readings);

// How near the poses are to singularities.
struct SingularityMeasures {
  RowMatrix serial;  // N x legs: dh/dq, zero where the leg is stretched or folded (type 1)
  Vector parallel;   // N: det(dg/dpose), zero at a type 2 singularity; sqrt(det J'J) with
                     //    more legs than degrees of freedom. With several closures a leg of all
                     //    rows of closed_pose_jacobian
  Vector condition;  // N: condition number of dq/dpose (and those rows), orientation in units of
                     //    1 / characteristic_length; infinite when singular. Of the active joints,
                     //    not of the readings: what a sensor counts does not bend a mechanism.
                     //    Where some turn and others travel, of an angle the arc at that length.
};
SingularityMeasures singularity_measures(const Mechanism& mechanism, ConstRows poses,
                                         double characteristic_length);

// What makes the rows of closed_pose_jacobian into active joints, of one unit, and metres: a leg's
// gain (times the length, see SingularityMeasures), and one.
Vector row_scales(const Mechanism& mechanism, double characteristic_length);

// Condition numbers by a closed_pose_jacobian and its scales, as above.
Vector pose_conditions(const RowMatrix& jacobian, ConstVector scales, PoseSpace space,
                       double characteristic_length);
// Determinant by a row of it (rows x dof), as above.
double pose_determinant(const double* jacobian, Index rows, Index dof);

}  // namespace symkin
