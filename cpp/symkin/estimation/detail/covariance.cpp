// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/covariance.hpp"

#include <map>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// influence diag(weights) influence'
RowMatrix sandwich(const RowMatrix& influence, const Vector& weights) {
  return product(influence * weights.asDiagonal(), influence.transpose());
}

// What the errors of the poses that both legs use have in common.
RowMatrix cross_covariance(const LegInfluence& a, const LegInfluence& b, const Vector& sigma) {
  RowMatrix covariance = RowMatrix::Zero(a.influence.rows(), b.influence.rows());
  std::size_t k = 0;
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    while (k < b.rows.size() && b.rows[k] < a.rows[i]) {
      ++k;
    }
    for (std::size_t j = k; j < b.rows.size() && b.rows[j] == a.rows[i]; ++j) {
      const auto in_a = static_cast<Index>(i);
      const auto in_b = static_cast<Index>(j);
      const double common =
          a.by_pose.row(in_a).cwiseProduct(b.by_pose.row(in_b)).dot(sigma.transpose());
      covariance.noalias() += (common * a.influence.col(in_a)) * b.influence.col(in_b).transpose();
    }
  }
  return covariance;
}

}  // namespace

RowMatrix declared_covariance(const std::vector<LegInfluence>& legs, PoseSpace space,
                              const MeasurementNoise& noise) {
  const Vector sigma = noise.pose_variances(space);
  const Index p = legs.front().influence.rows();
  const auto count = static_cast<Index>(legs.size());
  RowMatrix covariance(count * p, count * p);
  for (Index a = 0; a < count; ++a) {
    const LegInfluence& first = legs[static_cast<std::size_t>(a)];
    covariance.block(a * p, a * p, p, p) = sandwich(first.influence, first.variances);
    for (Index b = a + 1; b < count; ++b) {
      const RowMatrix block = cross_covariance(first, legs[static_cast<std::size_t>(b)], sigma);
      covariance.block(a * p, b * p, p, p) = block;
      covariance.block(b * p, a * p, p, p) = block.transpose();
    }
  }
  return covariance;
}

RowMatrix residual_covariance(const std::vector<LegInfluence>& legs) {
  const Index p = legs.front().influence.rows();
  const auto size = static_cast<Index>(legs.size()) * p;
  std::map<Index, Vector> changes;  // of the estimates, were the pose left out
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const LegInfluence& leg = legs[i];
    for (std::size_t k = 0; k < leg.rows.size(); ++k) {
      Vector& change = changes.try_emplace(leg.rows[k], Vector::Zero(size)).first->second;
      const auto column = static_cast<Index>(k);
      change.segment(static_cast<Index>(i) * p, p) +=
          leg.influence.col(column) * leg.deleted[column];
    }
  }
  RowMatrix covariance = RowMatrix::Zero(size, size);
  for (const auto& [row, change] : changes) {
    covariance.noalias() += change * change.transpose();
  }
  return covariance;
}

}  // namespace symkin
