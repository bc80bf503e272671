// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/support/types.hpp"

namespace symkin {

// Value that chi-square with n > 0 degrees of freedom exceeds with the given probability.
double chi_square_limit(double degrees_of_freedom, double probability);

// What Student's t leaves on both sides together with the given probability; of infinitely many
// degrees the normal's.
double student_limit(double probability, double degrees_of_freedom);

// Probabilities that a variable is as far out as a value. One where a test has no degree of freedom
// left, so that it never alarms.
double chi_square_tail(double value, double degrees_of_freedom);
double f_tail(double value, Index numerator, Index denominator);
double normal_tails(double value);                             // both sides
double student_tails(double value, Index degrees_of_freedom);  // both sides

// Probability that the sum of n squared normals of deviation one falls short of a value, their
// means being anything whose squares sum to the noncentrality.
double noncentral_chi_square(double value, double degrees_of_freedom, double noncentrality);

}  // namespace symkin
