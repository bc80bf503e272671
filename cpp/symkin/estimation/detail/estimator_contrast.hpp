// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/estimation/detail/projection.hpp"

namespace symkin {

// The estimate of `implicit` less that of `joint` is linear in the residuals: how many directions
// it depends on, and the squares of the residuals in them. None where the estimators are the same.
// The quadratic form in the inverse covariance of the difference (Hausman's) would reject too many
// sound robots.
struct EstimatorContrast {
  Index terms = 0;
  double square = 0;
};
// Of a system of legs with one closure each.
EstimatorContrast estimator_contrast(const WhitenedClosures& system, const Projection& projection);

}  // namespace symkin
