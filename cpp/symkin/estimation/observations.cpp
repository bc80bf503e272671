// SPDX-License-Identifier: MIT
#include "symkin/estimation/observations.hpp"

#include <cmath>
#include <string>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

void check_observed(const Observed& observed, const char* what, Index poses, Index columns,
                    Index deviations) {
  const auto shape = [](const RowMatrix& matrix) {
    return std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols());
  };
  if (observed.values.rows() != poses || observed.values.cols() != columns ||
      observed.deviations.rows() != poses || observed.deviations.cols() != deviations) {
    throw InvalidInput(std::string(what) + " are " + shape(observed.values) + " with deviations " +
                       shape(observed.deviations) + "; expected " + std::to_string(poses) + " x " +
                       std::to_string(columns) + " with deviations " + std::to_string(poses) +
                       " x " + std::to_string(deviations));
  }
  for (Index i = 0; i < poses; ++i) {
    for (Index k = 0; k < columns; ++k) {
      const double deviation = observed.deviations(i, std::min(k, deviations - 1));
      if (std::isinf(observed.values(i, k)) ||
          (std::isfinite(observed.values(i, k)) && !(deviation >= 0 && std::isfinite(deviation)))) {
        throw InvalidInput(std::string(what) + ", pose " + std::to_string(i + 1) + ", column " +
                           std::to_string(k + 1) +
                           ": expected a finite value, or NaN if it was not measured, and a "
                           "standard deviation of zero or more");
      }
    }
  }
}

void check_covariates(const RowMatrix& values, const char* whose, Index poses, Index columns) {
  if (values.cols() == 0) {
    return;  // all are zero
  }
  if (values.rows() != poses || values.cols() != columns || !values.allFinite()) {
    throw InvalidInput("the covariates of " + std::string(whose) + " are " +
                       std::to_string(values.rows()) + " x " + std::to_string(values.cols()) +
                       "; expected finite ones, " + std::to_string(poses) + " x " +
                       std::to_string(columns));
  }
}

}  // namespace

Observed Observed::of(const std::vector<Index>& poses) const {
  if (!any()) {
    return {};
  }
  return {values(poses, kAll), deviations(poses, kAll)};
}

bool Observations::any(Index pose) const {
  return readings.any(pose) || poses.any(pose) || reported.any(pose) || points.any(pose) ||
         distances.any(pose) || heights.any(pose);
}

Observations Observations::of(const std::vector<Index>& some) const {
  const auto rows = [&](const RowMatrix& all) {
    return all.cols() > 0 ? RowMatrix(all(some, kAll)) : RowMatrix();
  };
  return {readings.of(some),  poses.of(some),   reported.of(some),    points.of(some),
          distances.of(some), heights.of(some), rows(leg_covariates), rows(base_covariates)};
}

void Observations::check(const Mechanism& mechanism, const Setup& setup) const {
  const PoseSpace space = mechanism.pose_space();
  const Index n = count();
  if (n == 0) {
    throw InvalidInput("there are no observations");
  }
  check_observed(readings, "readings", n, mechanism.leg_count(), mechanism.leg_count());
  const Index points_expected = setup.points.rows() * position_size(space);
  const struct {
    const Observed& observed;
    const char* what;
    Index columns, deviations;
  } kinds[] = {
      {poses, "poses", coordinate_count(space), mechanism.dof()},
      {reported, "reported poses", coordinate_count(space), mechanism.dof()},
      {points, "points", points_expected, points_expected},
      {distances, "distances", setup.anchors.rows(), setup.anchors.rows()},
      {heights, "heights", 1, 1},
  };
  for (const auto& kind : kinds) {
    if (kind.observed.any()) {
      check_observed(kind.observed, kind.what, n, kind.columns, kind.deviations);
    }
  }
  check_covariates(leg_covariates, "the legs", n, setup.leg_slopes.size());
  check_covariates(base_covariates, "the base", n, setup.base_slopes.rows());
  if (heights.any() && position_size(space) != 3) {
    throw InvalidInput("heights above a plane are for platforms that move in space; this one is " +
                       std::string(to_string(space)));
  }
  if ((points.any() || distances.any()) && position_size(space) == 0) {
    throw InvalidInput(
        "points and distances are for platforms that move; a spherical one only turns");
  }
}

}  // namespace symkin
