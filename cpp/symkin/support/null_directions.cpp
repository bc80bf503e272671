// SPDX-License-Identifier: MIT
#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

constexpr double kNothing = 1e-9;  // of a direction of length one

}  // namespace

RowMatrix named_directions(RowMatrix directions, const Vector& scale) {
  // Gauss-Jordan by columns; the pivot is the largest value of all directions that have none yet.
  for (Index k = 0; k < directions.cols(); ++k) {
    Index parameter = 0;
    Index column = 0;
    directions.rightCols(directions.cols() - k).cwiseAbs().maxCoeff(&parameter, &column);
    directions.col(k).swap(directions.col(k + column));
    directions.col(k) /= directions(parameter, k);
    for (Index other = 0; other < directions.cols(); ++other) {
      if (other != k) {
        directions.col(other) -= directions(parameter, other) * directions.col(k).eval();
      }
    }
  }
  directions = (directions.array().abs() > kNothing).select(directions, 0).eval();
  directions = (scale.asDiagonal() * directions).eval();
  directions.colwise().normalize();
  return directions;
}

}  // namespace symkin
