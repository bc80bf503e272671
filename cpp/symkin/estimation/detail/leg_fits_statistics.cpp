// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "symkin/estimation/detail/leg_fits.hpp"
#include "symkin/estimation/detail/linear_fit.hpp"

namespace symkin {

// What a loss does not guard is for identify() to refuse or to name.
void LegFits::guard() {
  kernels_.invert(rows_, information_.data(), inverse_.data());
  kernels_.influence(rows_, inverse_.data(), leverages_.data(), jackknife_.data());
  for (Index lane = 0; lane < count_; ++lane) {
    for (Index i = 0; i < rows_.count; ++i) {
      if (at(present_, i, lane) > 0 && !(at(leverages_, i, lane) <= kGuarded)) {
        states_[place(lane)].clear = false;
      }
    }
  }
}

bool LegFits::rejects(Index lane) {
  for (Index i = 0; i < rows_.count; ++i) {
    if (at(present_, i, lane) > 0 && at(weights_, i, lane) < kRejectedWeight) {
      return true;
    }
  }
  return false;
}

// Whitened closures of a lane, a block a pose.
WhitenedSystem LegFits::system(Index lane) {
  const Index closures = static_cast<Index>(chosen_[place(lane)].size()) * rows_.closures;
  const Index width = rows_.parameters + rows_.dof + 2;
  WhitenedSystem system;
  system.jacobian.resize(closures, rows_.size);
  system.residual.resize(closures);
  for (Index i = 0; i < closures; ++i) {
    const double factor = std::sqrt(at(precisions_, i, lane));
    system.residual[i] = factor * at(closure_rows_, i * width, lane);
    for (Index k = 0; k < rows_.size; ++k) {
      system.jacobian(i, k) =
          factor * at(closure_rows_, i * width + 1 + estimated_[place(k)], lane);
    }
    if ((i + 1) % rows_.closures == 0) {
      system.first.push_back(i + 1);
    }
  }
  return system;
}

void LegFits::describe() {
  const bool robust = stages_.size() > 1;
  if (options_.estimator == Estimator::joint) {
    for (Index lane = 0; lane < count_; ++lane) {
      fits_[place(lane)].clear = states_[place(lane)].clear;
    }
    return;
  }
  if (in_readings_) {
    linearise();
  }
  if (robust || in_readings_) {
    kernels_.sum(rows_, robust ? weights_.data() : nullptr, nullptr, information_.data(),
                 gradient_.data());
    kernels_.solve(rows_, information_.data(), gradient_.data(), step_.data(), decrease_.data(),
                   pivot_.data());
  }
  Packed noise;
  if (in_readings_) {
    noise = weigh_as_readings();
  } else {
    kernels_.invert(rows_, information_.data(), inverse_.data());
  }
  for (Index lane = 0; lane < count_; ++lane) {
    LegFit& fit = fits_[place(lane)];
    fit.clear = states_[place(lane)].clear && LinearFit::is_clear(at(pivot_, 0, lane));
    fit.closures = static_cast<Index>(chosen_[place(lane)].size()) * rows_.closures;
    fit.closure_squares = at(closure_squares_, 0, lane);
    if (!fit.clear) {
      continue;
    }
    const double factor = robust ? describe_robust(lane, fit) : 1;
    for (Index k = 0; k < rows_.size; ++k) {
      fit.variances[estimated_[place(k)]] = factor * variance(noise, k, lane);
    }
    if (!robust) {
      fit.goodness = judge(std::max(at(whitened_, 0, lane) - at(decrease_, 0, lane), 0.0),
                           fit.closures - rows_.size);
    }
  }
}

// By the inverse of the information, if that is the inverse of the covariance, or by what the noise
// makes of it.
double LegFits::variance(Packed& noise, Index k, Index lane) {
  const Index n = rows_.size;
  if (noise.empty()) {
    return at(inverse_, k * n + k, lane);
  }
  double sum = 0;
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j <= i; ++j) {
      sum += (i == j ? 1 : 2) * at(inverse_, k * n + i, lane) * at(noise, i * n + j, lane) *
             at(inverse_, k * n + j, lane);
    }
  }
  return sum;
}

// Returns the factor on the variances.
double LegFits::describe_robust(Index lane, LegFit& fit) {
  const auto there = static_cast<Index>(chosen_[place(lane)].size());
  Vector squares(there);
  fit.rejected = 0;
  for (Index i = 0; i < there; ++i) {
    squares[i] = at(squares_, i, lane);
    fit.rejected += at(weights_, i, lane) < kRejectedWeight ? 1 : 0;
  }
  const RobustStatistics found = robust_statistics(
      squares, std::vector<Index>(place(there), rows_.closures), rows_.size, stages_.back());
  fit.student_degrees = found.student_degrees;
  fit.goodness = judged({leg_}, found.chi_square, found.degrees_of_freedom, mechanism_.leg_count());
  return found.variance;
}

// Fits have few different degrees of freedom, and a limit takes longer than a step.
const GoodnessOfFit& LegFits::judge(double chi_square, Index degrees_of_freedom) {
  auto [known, is_new] = judged_.try_emplace(degrees_of_freedom);
  if (is_new) {
    known->second =
        judged({leg_}, chi_square, static_cast<double>(degrees_of_freedom), mechanism_.leg_count());
  }
  known->second.chi_square = chi_square;
  return known->second;
}

void LegFits::find_jackknife() {
  kernels_.influence(rows_, inverse_.data(), leverages_.data(), jackknife_.data());
  for (Index lane = 0; lane < count_; ++lane) {
    for (Index k = 0; k < rows_.size; ++k) {
      fits_[place(lane)].jackknife[estimated_[place(k)]] = at(jackknife_, k, lane);
    }
  }
}

}  // namespace symkin
