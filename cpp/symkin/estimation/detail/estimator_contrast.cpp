// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/estimator_contrast.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// How the estimate by `implicit` of one leg answers to its closures, p x poses where it was read;
// not to those of poses left out.
RowMatrix implicit_influence(const WhitenedClosures& system, const std::vector<RowMatrix>& of_poses,
                             const Projection& projection, std::size_t place) {
  const Projection::LegBlock& leg = projection.legs()[place];
  std::vector<Index> used;      // of the leg's poses
  std::vector<Index> measured;  // their rows
  std::vector<double> factors;
  for (std::size_t i = 0; i < leg.poses.size(); ++i) {
    const auto at = static_cast<std::size_t>(leg.poses[i]);
    const WhitenedPose& pose = system.poses[at];
    if (projection.counts(leg.poses[i])) {
      used.push_back(static_cast<Index>(i));
      measured.push_back(pose.row);
      factors.push_back(1 / of_poses[at].row(leg.rows[i] - pose.first).norm());
    }
  }
  const RowMatrix by_parameters =
      system.of_legs[place].by_parameters(measured, system.estimated[place]);
  RowMatrix influence = RowMatrix::Zero(by_parameters.cols(), static_cast<Index>(leg.poses.size()));
  influence(kAll, used) =
      LinearFit(by_parameters,
                Eigen::Map<const Vector>(factors.data(), static_cast<Index>(factors.size())))
          .influence();
  return influence;
}

}  // namespace

EstimatorContrast estimator_contrast(const WhitenedClosures& system, const Projection& projection) {
  constexpr double kDirections = 0.01;  // of the largest, in variance
  constexpr double kSame = 1e-12;       // of a standard deviation, squared
  const RowMatrix& coordinates = projection.coordinates();
  const Index p = coordinates.rows();
  if (projection.rank() < p) {
    return {};
  }
  const auto& legs = projection.legs();
  std::vector<RowMatrix> of_poses;  // L
  for (const WhitenedPose& pose : system.poses) {
    of_poses.push_back(lower_inverse(pose.units));
  }
  // By the residuals of each leg, p x rows of the leg: that of `joint` is -BQ', B the coordinates.
  std::vector<RowMatrix> contrast;
  contrast.reserve(legs.size());
  for (const Projection::LegBlock& leg : legs) {
    contrast.push_back(-product(coordinates.rightCols(leg.basis.cols()), leg.basis.transpose()));
  }
  for (std::size_t a = 0; a < legs.size(); ++a) {
    const RowMatrix influence = implicit_influence(system, of_poses, projection, a);
    std::vector<std::size_t> next(legs.size(), 0);  // row of each leg's block
    for (std::size_t i = 0; i < legs[a].poses.size(); ++i) {
      const auto at = static_cast<std::size_t>(legs[a].poses[i]);
      const WhitenedPose& pose = system.poses[at];
      const Index own = legs[a].rows[i] - pose.first;
      // The leg's closure is the factor's row times the whitened ones up to its own.
      for (Index j = 0; j <= own; ++j) {
        const auto b =
            static_cast<std::size_t>(system.position(pose.legs[static_cast<std::size_t>(j)]));
        while (legs[b].rows[next[b]] < pose.first + j) {
          ++next[b];
        }
        contrast[b].col(static_cast<Index>(next[b])).segment(system.columns[a], influence.rows()) +=
            of_poses[at](own, j) * influence.col(static_cast<Index>(i));
      }
    }
  }
  const Vector precisions = coordinates.rowwise().norm().cwiseInverse();
  RowMatrix square = RowMatrix::Zero(p, p);
  Vector values = Vector::Zero(p);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    contrast[i] = precisions.asDiagonal() * contrast[i];
    square += product(contrast[i], contrast[i].transpose());
    values += contrast[i] * projection.residual()(legs[i].rows);
  }
  const SymmetricEigen eigen = symmetric_eigen(square);  // ascending
  const double largest = eigen.values[p - 1];
  if (!(largest > kSame)) {
    return {};
  }
  const Index terms = (eigen.values.array() > kDirections * largest).count();
  const Vector along = eigen.vectors.rightCols(terms).transpose() * values;
  return {terms, along.cwiseQuotient(eigen.values.tail(terms).cwiseSqrt()).squaredNorm()};
}

}  // namespace symkin
