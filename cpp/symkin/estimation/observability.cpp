// SPDX-License-Identifier: MIT
#include "symkin/estimation/observability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/scale_rows.hpp"

namespace symkin {
namespace {

// O1 = (s_1 ... s_p)^(1/p) / p as the paper's Eq. 13 has it (Borm and Menq 1989 divide by the root
// of the number of poses), O2 = s_p/s_1 (Driels and Pathre 1990), O3 = s_p (Nahvi, Hollerbach and
// Hayward 1994), O4 = s_p^2/s_1 (Nahvi and Hollerbach 1996), O5 = 1/sum(1/s_i) (Sun and Hollerbach
// 2008, Observability index selection).
std::array<double, 5> indices_of(const Vector& s) {
  const auto p = static_cast<double>(s.size());
  const double largest = s[0];
  const double smallest = s[s.size() - 1];
  return {std::exp(s.array().log().sum() / p) / p, smallest / largest, smallest,
          smallest * smallest / largest, 1 / s.array().inverse().sum()};
}

// The columns of what is estimated of a leg.
RowMatrix estimated(const Mechanism& mechanism, Index leg, RowMatrix by_parameters) {
  const std::vector<Index>& columns = mechanism.estimated_parameters(leg);
  if (static_cast<Index>(columns.size()) == by_parameters.cols()) {
    return by_parameters;
  }
  return by_parameters(kAll, columns);
}

ClosureRows linearise_nominal(const Mechanism& mechanism, Index leg, ConstRows poses) {
  ClosureRows rows = linearise(mechanism, leg, poses, inverse_kinematics(mechanism, leg, poses));
  rows.by_parameters = estimated(mechanism, leg, std::move(rows.by_parameters));
  return rows;
}

RowMatrix paper_rows(const Mechanism& mechanism, Index leg, ConstRows poses) {
  const Index closures = mechanism.closures();
  if (closures == 1) {
    return estimated(mechanism, leg, parameter_jacobian(mechanism, leg, poses));
  }
  check_poses(mechanism, poses);
  ClosureRows rows = linearise_nominal(mechanism, leg, poses);
  rows.eliminate_reading(closures);
  for (Index i = 0; i < rows.by_reading.size(); i += closures) {
    rows.by_parameters.row(i) /= -rows.by_reading[i];
  }
  return std::move(rows.by_parameters);
}

// Each leg's rows in its own columns.
RowMatrix paper_rows_of_all(const Mechanism& mechanism, ConstRows poses) {
  const Index legs = mechanism.leg_count();
  const Index closures = mechanism.closures();
  RowMatrix rows = RowMatrix::Zero(poses.rows() * legs * closures, mechanism.first_estimated(legs));
  for (Index leg = 0; leg < legs; ++leg) {
    const RowMatrix own = paper_rows(mechanism, leg, poses);
    const Index column = mechanism.first_estimated(leg);
    for (Index i = 0; i < poses.rows(); ++i) {
      rows.block((i * legs + leg) * closures, column, closures, own.cols()) =
          own.middleRows(i * closures, closures);
    }
  }
  return rows;
}

// The closures of some legs, whitened together at each pose; NaN where one of them cannot reach.
RowMatrix whitened_rows(const Mechanism& mechanism, const std::vector<Index>& legs, ConstRows poses,
                        const MeasurementNoise& noise) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr Index kTogether = 128;  // poses, whose latent poses stay in the caches
  const Index of_pose = static_cast<Index>(legs.size()) * mechanism.closures();
  Index columns = 0;
  for (const Index leg : legs) {
    columns += mechanism.estimated_count(leg);
  }
  RowMatrix rows = RowMatrix::Constant(poses.rows() * of_pose, columns, kNan);
  for (Index first = 0; first < poses.rows(); first += kTogether) {
    const Index count = std::min(kTogether, poses.rows() - first);
    MeasurementSet exact{poses.middleRows(first, count),
                         RowMatrix::Constant(count, mechanism.leg_count(), kNan),
                         std::vector<Index>(static_cast<std::size_t>(count), -1)};
    for (const Index leg : legs) {
      exact.readings.col(leg) = inverse_kinematics(mechanism, leg, exact.poses);
    }
    const WhitenedClosures system =
        whiten_closures(mechanism, exact, legs, noise, LinearisedAt::measured, first);
    for (const WhitenedPose& pose : system.poses) {
      if (pose.count() == of_pose) {
        rows.middleRows((first + pose.row) * of_pose, of_pose) =
            system.jacobian.middleRows(pose.first, of_pose);
      }
    }
  }
  return rows;
}

}  // namespace

RowMatrix observability_rows(const Mechanism& mechanism, Index leg, ConstRows poses, RowKind kind,
                             const MeasurementNoise& noise) {
  if (kind == RowKind::paper) {
    return paper_rows(mechanism, leg, poses);
  }
  noise.check();
  check_poses(mechanism, poses);
  if (mechanism.closures() > 1) {
    return whitened_rows(mechanism, {leg}, poses, noise);
  }
  ClosureRows rows = linearise_nominal(mechanism, leg, poses);
  scale_rows(rows.by_parameters,
             closure_variances(rows, mechanism.pose_space(), noise).array().sqrt().inverse());
  return std::move(rows.by_parameters);
}

RowMatrix mechanism_rows(const Mechanism& mechanism, ConstRows poses, RowKind kind,
                         const MeasurementNoise& noise) {
  if (kind == RowKind::paper) {
    return paper_rows_of_all(mechanism, poses);
  }
  noise.check();
  check_poses(mechanism, poses);
  return whitened_rows(mechanism, all_legs(mechanism.leg_count()), poses, noise);
}

Observability analyse_observability(ConstRows rows, ConstVector scale) {
  const Index p = rows.cols();
  if (p == 0 || scale.size() != p) {
    throw InvalidInput("the scale has " + std::to_string(scale.size()) + " values for rows of " +
                       std::to_string(p) + " parameters; expected one a parameter");
  }
  if (!scale.allFinite() || !(scale.minCoeff() > 0)) {
    throw InvalidInput("the scale of a parameter is not positive; expected typical errors");
  }
  if (rows.rows() < p) {
    throw InvalidInput(std::to_string(rows.rows()) + " rows cannot show " + std::to_string(p) +
                       " parameters; expected at least as many poses");
  }
  if (!rows.allFinite()) {
    throw InvalidInput("the observability rows are not finite: a pose is out of the leg's reach");
  }
  Observability result;
  result.r_diagonal = triangular_factor(rows).diagonal().cwiseAbs();
  const RowMatrix in_scale = rows * scale.asDiagonal();
  result.indices = indices_of(singular_values(in_scale));
  const Vector unit = inverse_column_lengths(in_scale);
  const RightSingular svd = right_singular(in_scale * unit.asDiagonal());
  result.singular_values = svd.values;
  result.condition = result.singular_values[0] / result.singular_values[p - 1];
  result.rank = (result.singular_values.array() > 1e-10 * result.singular_values[0]).count();
  result.null_directions = unit.asDiagonal() * svd.vectors.rightCols(p - result.rank);
  result.null_directions.colwise().normalize();
  return result;
}

}  // namespace symkin
