// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {

// g - psi over one deviation, as symkin::linearise_readings() writes them.
void LegFits::linearise_readings() {
  const Index p = rows_.parameters, width = p + rows_.dof + 2;
  const Index coordinates = coordinate_count(mechanism_.pose_space());
  Packed shown = readings_, errors(readings_.size());
  Vector parameters(p), readings(rows_.count), roots(rows_.count), differences(rows_.count);
  RowMatrix poses(rows_.count, coordinates);
  for (Index lane = 0; lane < count_; ++lane) {
    for (Index k = 0; k < p; ++k) {
      parameters[k] = at(parameters_, k, lane);
    }
    for (Index i = 0; i < rows_.count; ++i) {
      readings[i] = at(readings_, i, lane);
      for (Index k = 0; k < coordinates; ++k) {
        poses(i, k) = at(poses_, i * coordinates + k, lane);
      }
    }
    model_.inverse_kinematics(parameters, mechanism_.leg(leg_).working_mode, poses, roots);
    model_.reading_differences(parameters, roots, readings, differences);
    for (Index i = 0; i < rows_.count; ++i) {
      at(shown, i, lane) += differences[i];
      at(errors, i, lane) = differences[i];
    }
  }
  model_.linearise_lanes({lanes_, rows_.count, parameters_.data(), poses_.data(), shown.data()},
                         rows_.rows);
  std::fill(whitened_.begin(), whitened_.end(), 0);
  for (Index i = 0; i < rows_.count; ++i) {
    for (Index lane = 0; lane < lanes_; ++lane) {
      const double by_reading = at(closure_rows_, (i + 1) * width - 1, lane);
      for (Index k = 1; k <= p; ++k) {
        at(closure_rows_, i * width + k, lane) /= -by_reading;
      }
      const double error = at(closure_rows_, i * width, lane) = at(errors, i, lane);
      const double precision = at(present_, i, lane) * unit_precisions_[place(lane)];
      at(precisions_, i, lane) = precision;
      at(whitened_, 0, lane) += precision * error * error;
    }
  }
  judged_squares_ = whitened_;  // the weights are held
}

// One for all poses, so that the cost stays the paper's: the mean variance of g - psi at the start.
void LegFits::take_deviations() {
  const Index width = rows_.parameters + rows_.dof + 2;
  linearise();
  for (Index lane = 0; lane < lanes_; ++lane) {
    double sum = 0, poses = 0;
    for (Index i = 0; i < rows_.count; ++i) {
      if (at(present_, i, lane) > 0) {
        const double by_reading = at(closure_rows_, (i + 1) * width - 1, lane);
        sum += 1 / (at(precisions_, i, lane) * by_reading * by_reading);
        poses += 1;
      }
    }
    unit_precisions_[place(lane)] = poses / sum;
  }
}

// What the declared noise of the closures makes of an estimate that does not weigh them by it; from
// now on the rows are weighed as it does, and `inverse_` is its own. Returns J'W V W J, W its
// weights and V the variances.
LegFits::Packed LegFits::weigh_as_readings() {
  const Index width = rows_.parameters + rows_.dof + 2;
  for (Index i = 0; i < rows_.count; ++i) {
    for (Index lane = 0; lane < lanes_; ++lane) {
      const double by_reading = at(closure_rows_, (i + 1) * width - 1, lane);
      const double own = at(present_, i, lane) / (by_reading * by_reading);
      at(weights_, i, lane) = own > 0 ? own / at(precisions_, i, lane) : 0;
      at(precisions_, i, lane) = own;
    }
  }
  kernels_.sum(rows_, weights_.data(), nullptr, information_.data(), gradient_.data());
  Packed noise = information_;
  kernels_.sum(rows_, nullptr, nullptr, information_.data(), gradient_.data());
  kernels_.invert(rows_, information_.data(), inverse_.data());
  return noise;
}

}  // namespace symkin
