// SPDX-License-Identifier: MIT
#include "symkin/kinematics/continuation.hpp"

#include <limits>
#include <string>
#include <vector>

#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kNotReached = std::numeric_limits<double>::quiet_NaN();
constexpr int kSteps = 8;
// A step that leads anywhere needs about five iterations; what leads nowhere takes all there are,
// each many times as long where legs are declared, in whose loops nothing closes any more.
constexpr ForwardKinematicsOptions kByStep{12};
constexpr ForwardKinematicsOptions kFromNeighbour{25};

using Rows = std::vector<Index>;

// Those of some rows whose reading is finite and whose pose is known, or is not.
Rows finite_rows(const RowMatrix& readings, const RowMatrix& poses, bool known) {
  Rows rows;
  for (Index i = 0; i < readings.rows(); ++i) {
    if (readings.row(i).allFinite() && poses.row(i).allFinite() == known) {
      rows.push_back(i);
    }
  }
  return rows;
}

// How far each row's readings are from those at home, angles the short way round.
RowMatrix ways_from(const Mechanism& mechanism, const RowMatrix& readings, const RowMatrix& home) {
  RowMatrix ways(readings.rows(), readings.cols());
  for (Index leg = 0; leg < readings.cols(); ++leg) {
    const Vector to = readings.col(leg);
    const Vector from = Vector::Constant(to.size(), home(0, leg));
    Vector difference(to.size());
    mechanism.model(leg).reading_differences(mechanism.leg(leg).parameters, to, from, difference);
    ways.col(leg) = difference;
  }
  return ways;
}

// The poses at the readings from these starts, a row each; NaN where there is none.
RowMatrix solved(const Mechanism& mechanism, const RowMatrix& readings, const RowMatrix& starts,
                 const ForwardKinematicsOptions& options) {
  ForwardKinematicsResult result = forward_kinematics(mechanism, readings, starts, options);
  for (Index i = 0; i < readings.rows(); ++i) {
    if (result.status[static_cast<std::size_t>(i)] != ForwardStatus::converged) {
      result.poses.row(i).setConstant(kNotReached);
    }
  }
  return result.poses;
}

void step_from_home(const Mechanism& mechanism, const RowMatrix& ways, const RowMatrix& at_home,
                    ConstVector home, RowMatrix& poses, Rows rows) {
  RowMatrix starts = home.transpose().replicate(static_cast<Index>(rows.size()), 1);
  for (int step = 1; step <= kSteps && !rows.empty(); ++step) {
    const RowMatrix part = ways(rows, kAll) * (static_cast<double>(step) / kSteps);
    const RowMatrix reached = solved(mechanism, part.rowwise() + at_home.row(0), starts, kByStep);
    Rows left;
    Rows from;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (reached.row(static_cast<Index>(k)).allFinite()) {
        left.push_back(rows[k]);
        from.push_back(static_cast<Index>(k));
      }
    }
    starts = reached(from, kAll);
    rows = std::move(left);
  }
  poses(rows, kAll) = starts;
}

// One pass over the rows that are not reached; whether it reached one.
bool step_from_neighbours(const Mechanism& mechanism, const RowMatrix& readings,
                          const RowMatrix& ways, RowMatrix& poses) {
  const Rows reached = finite_rows(readings, poses, true);
  const Rows open = finite_rows(readings, poses, false);
  if (reached.empty() || open.empty()) {
    return false;
  }
  const RowMatrix known = ways(reached, kAll);
  RowMatrix starts(static_cast<Index>(open.size()), poses.cols());
  for (std::size_t k = 0; k < open.size(); ++k) {
    Index nearest = 0;
    (known.rowwise() - ways.row(open[k])).rowwise().squaredNorm().minCoeff(&nearest);
    starts.row(static_cast<Index>(k)) = poses.row(reached[static_cast<std::size_t>(nearest)]);
  }
  const RowMatrix found = solved(mechanism, readings(open, kAll), starts, kFromNeighbour);
  poses(open, kAll) = found;
  return found.array().isFinite().any();
}

}  // namespace

RowMatrix continued(const Mechanism& mechanism, const RowMatrix& readings, ConstVector home,
                    const RowMatrix& known) {
  check_readings(mechanism, readings.rows(), readings);
  RowMatrix poses = known;
  if (known.size() == 0) {
    poses = RowMatrix::Constant(readings.rows(), home.size(), kNotReached);
  }
  check_poses(mechanism, poses);
  if (poses.rows() != readings.rows()) {
    throw InvalidInput("known poses are " + std::to_string(poses.rows()) + "; expected " +
                       std::to_string(readings.rows()) + ", one a row of readings");
  }
  const RowMatrix home_row = home.transpose();
  const RowMatrix at_home = inverse_kinematics(mechanism, home_row);
  if (!at_home.allFinite()) {
    return poses;
  }
  const RowMatrix ways = ways_from(mechanism, readings, at_home);
  step_from_home(mechanism, ways, at_home, home, poses, finite_rows(readings, poses, false));
  while (step_from_neighbours(mechanism, readings, ways, poses)) {
  }
  return poses;
}

}  // namespace symkin
