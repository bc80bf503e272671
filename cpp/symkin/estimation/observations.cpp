// SPDX-License-Identifier: MIT
#include "symkin/estimation/observations.hpp"

#include <cmath>
#include <string>
#include <utility>

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

void check_axes(const Observed& observed, const char* what, Index poses, Index places) {
  const RowMatrix& axes = observed.axes;
  if (axes.cols() > 0 && (axes.rows() != poses || axes.cols() != 9 * places || !axes.allFinite())) {
    throw InvalidInput("the axes of the errors of " + std::string(what) + " are " +
                       std::to_string(axes.rows()) + " x " + std::to_string(axes.cols()) +
                       "; expected " + std::to_string(poses) + " x " + std::to_string(9 * places));
  }
}

bool turns_in_space(PoseSpace space) {
  return space == PoseSpace::spatial || space == PoseSpace::spherical;
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

Observations Observations::in_full(PoseSpace space, const MeasurementSet& measurements,
                                   const MeasurementNoise& noise) {
  const auto everywhere = [](const RowMatrix& values, const Vector& deviations) {
    return Observed{values, deviations.transpose().replicate(values.rows(), 1)};
  };
  Observations observations;
  observations.readings = everywhere(measurements.readings,
                                     Vector::Constant(measurements.readings.cols(), noise.reading));
  observations.poses = everywhere(measurements.poses, noise.pose_variances(space).cwiseSqrt());
  return observations;
}

Observed Observed::of(const std::vector<Index>& poses) const {
  if (!any()) {
    return {};
  }
  const auto rows = axes.cols() > 0 ? RowMatrix(axes(poses, kAll)) : RowMatrix();
  return {values(poses, kAll), deviations(poses, kAll), rows};
}

bool Observations::any(Index pose) const {
  return readings.any(pose) || poses.any(pose) || reported.any(pose) || points.any(pose) ||
         distances.any(pose) || heights.any(pose) || attitudes.any(pose) || turns.any(pose);
}

bool Observations::couples(Index pose, Index k) const {
  const auto any = [&](const Observed& observed) {
    const Index each = observed.values.cols() / partners.cols();
    return observed.any() &&
           !observed.values.row(pose).segment(k * each, each).array().isNaN().all();
  };
  return partners(pose, k) >= 0 && (any(separations) || any(rises) || any(offsets));
}

Observations Observations::of(const std::vector<Index>& some) const {
  const auto rows = [&](const RowMatrix& all) {
    return all.cols() > 0 ? RowMatrix(all(some, kAll)) : RowMatrix();
  };
  std::vector<double> place(static_cast<std::size_t>(count()), -1);
  for (std::size_t i = some.size(); i-- > 0;) {
    place[static_cast<std::size_t>(some[i])] = static_cast<double>(i);
  }
  RowMatrix others = rows(partners);
  for (double& other : others.reshaped()) {
    other = other < 0 ? -1 : place[static_cast<std::size_t>(other)];
  }
  return {readings.of(some),  poses.of(some),       reported.of(some),    points.of(some),
          distances.of(some), heights.of(some),     attitudes.of(some),   turns.of(some),
          rows(turn_axes),    std::move(others),    separations.of(some), rises.of(some),
          offsets.of(some),   rows(leg_covariates), rows(base_covariates)};
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
      {attitudes, "attitudes", 3, 3},
      {turns, "turns", 1, 1},
      {separations, "separations", partners.cols(), partners.cols()},
      {rises, "rises", partners.cols(), partners.cols()},
      {offsets, "offsets", partners.cols() * position_size(space),
       partners.cols() * position_size(space)},
  };
  for (const auto& kind : kinds) {
    if (kind.observed.any()) {
      check_observed(kind.observed, kind.what, n, kind.columns, kind.deviations);
    }
  }
  for (Index i = 0; i < partners.size(); ++i) {
    const Index own = i / partners.cols();
    const double other = partners.reshaped<Eigen::RowMajor>()[i];
    if (partners.rows() != n || !(other < static_cast<double>(n)) || other != std::round(other) ||
        other == static_cast<double>(own)) {
      throw InvalidInput("the other pose of pose " + std::to_string(own + 1) + " is " +
                         std::to_string(other) + "; expected another of " + std::to_string(n) +
                         " counted from 0, or -1");
    }
  }
  if (turns.any() && (turn_axes.rows() != n || turn_axes.cols() != 3 || !turn_axes.allFinite())) {
    throw InvalidInput("the axes of turns are " + std::to_string(turn_axes.rows()) + " x " +
                       std::to_string(turn_axes.cols()) + "; expected finite ones, " +
                       std::to_string(n) + " x 3");
  }
  check_axes(poses, "poses", n, std::min<Index>(position_size(space), 1));
  check_axes(points, "points", n, setup.points.rows());
  check_covariates(leg_covariates, "the legs", n, setup.leg_slopes.size());
  check_covariates(base_covariates, "the base", n, setup.base_slopes.rows());
  if (heights.any() && position_size(space) != 3) {
    throw InvalidInput("heights above a plane are for platforms that move in space; this one is " +
                       std::string(to_string(space)));
  }
  if ((attitudes.any() || turns.any()) && !turns_in_space(space)) {
    throw InvalidInput("roll, pitch, yaw and turns are of platforms that turn in space; this one " +
                       ("is " + std::string(to_string(space))));
  }
  if ((points.any() || distances.any()) && position_size(space) == 0) {
    throw InvalidInput(
        "points and distances are for platforms that move; a spherical one only turns");
  }
}

}  // namespace symkin
