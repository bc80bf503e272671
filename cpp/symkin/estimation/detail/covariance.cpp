// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/covariance.hpp"

#include <limits>
#include <map>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// p x dof: how the leg's estimate answers to the pose error of its k-th pose.
Eigen::MatrixXd answer_to_pose(const LegInfluence& leg, Index k) {
  return leg.influence.col(k) * leg.by_pose.row(k);
}

Eigen::MatrixXd cross_covariance(const LegInfluence& a, const LegInfluence& b,
                                 const Vector& sigma) {
  std::map<Index, Index> position_in_b;
  for (std::size_t k = 0; k < b.rows.size(); ++k) {
    position_in_b[b.rows[k]] = static_cast<Index>(k);
  }
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(a.influence.rows(), b.influence.rows());
  for (std::size_t k = 0; k < a.rows.size(); ++k) {
    const auto shared = position_in_b.find(a.rows[k]);
    if (shared != position_in_b.end()) {
      covariance.noalias() += answer_to_pose(a, static_cast<Index>(k)) * sigma.asDiagonal() *
                              answer_to_pose(b, shared->second).transpose();
    }
  }
  return covariance;
}

}  // namespace

RowMatrix inverse_information(const Eigen::MatrixXd& rows) {
  const Index p = rows.cols();
  const Vector scale = inverse_column_lengths(rows);
  const ColumnSpace space = column_space(rows * scale.asDiagonal());
  if (space.rank() < p) {
    return RowMatrix::Constant(p, p, std::numeric_limits<double>::infinity());
  }
  const Eigen::MatrixXd half = scale.asDiagonal() * space.coordinates;
  return half * half.transpose();
}

RowMatrix least_squares_influence(const RowMatrix& by_parameters, const Vector& factors,
                                  const Vector& loss_weights) {
  const Vector root_weights = factors.cwiseProduct(loss_weights.cwiseSqrt());
  const Eigen::MatrixXd weighted = root_weights.asDiagonal() * by_parameters;
  return inverse_information(weighted) * weighted.transpose() * root_weights.asDiagonal();
}

RowMatrix declared_covariance(const std::vector<LegInfluence>& legs, PoseSpace space,
                              const MeasurementNoise& noise) {
  const Vector sigma = noise.pose_variances(space);
  const Index p = legs.front().influence.rows();
  const auto count = static_cast<Index>(legs.size());
  RowMatrix covariance(count * p, count * p);
  for (Index a = 0; a < count; ++a) {
    for (Index b = a; b < count; ++b) {
      const LegInfluence& first = legs[static_cast<std::size_t>(a)];
      const LegInfluence& second = legs[static_cast<std::size_t>(b)];
      Eigen::MatrixXd block = cross_covariance(first, second, sigma);
      if (a == b) {
        const Vector deviations = noise.reading * first.by_reading;
        const Eigen::MatrixXd scaled = first.influence * deviations.asDiagonal();
        block += scaled * scaled.transpose();
      }
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
      change.segment(static_cast<Index>(i) * p, p) =
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
