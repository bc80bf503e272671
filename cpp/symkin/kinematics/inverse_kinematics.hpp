// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/mechanism.hpp"

namespace symkin {

// Sensor readings at the poses, N x legs, in the legs' working modes; NaN where a leg cannot reach.
RowMatrix inverse_kinematics(const Mechanism& mechanism, ConstRows poses);

// How far each leg is from the end of its reach, metres, N x legs; negative outside.
RowMatrix reach_margin(const Mechanism& mechanism, ConstRows poses);

// h of one leg, metres, N. Readings of that leg, one a pose (InvalidInput otherwise).
Vector closure(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings);

// The closure of one leg with all its derivatives.
ClosureRows linearise(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings);

// dg/dparam of one leg at its inverse kinematics, N x p: the rows of the paper's identification
// matrix C (Eqs. 8, 11). NaN where the leg cannot reach.
RowMatrix parameter_jacobian(const Mechanism& mechanism, Index leg, ConstRows poses);

// dg/dpose of all legs at the inverse kinematics, N x (legs * dof), leg by leg.
RowMatrix pose_jacobian(const Mechanism& mechanism, ConstRows poses);
// The same at given readings, N x legs.
RowMatrix pose_jacobian_at(const Mechanism& mechanism, ConstRows poses, ConstRows readings);

// How near the poses are to singularities.
struct SingularityMeasures {
  RowMatrix serial;  // N x legs: dh/dq, zero where the leg is stretched or folded (type 1)
  Vector parallel;   // N: det(dg/dpose), zero at a type 2 singularity; sqrt(det J'J) with
                     //    more legs than degrees of freedom
  Vector condition;  // N: condition number of dq/dpose, orientation in units of
                     //    1 / characteristic_length; infinite when singular. Of the active joints,
                     //    not of the readings: what a sensor counts does not bend a mechanism.
};
SingularityMeasures singularity_measures(const Mechanism& mechanism, ConstRows poses,
                                         double characteristic_length);

// The legs' gains, which make readings of dg/dpose into active joints.
Vector sensor_gains(const Mechanism& mechanism);

// Condition number by one dg/dpose (legs x dof, row by row) and the legs' gains, as above.
double pose_condition(const double* jacobian, ConstVector gains, PoseSpace space,
                      double characteristic_length);
// det(dg/dpose), as above.
double pose_determinant(const double* jacobian, Index legs, Index dof);

}  // namespace symkin
