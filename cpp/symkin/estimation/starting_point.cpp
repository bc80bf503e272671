// SPDX-License-Identifier: MIT
#include "symkin/estimation/starting_point.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/sensor.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// The setup's robot with sensors that show the active joints themselves, and what they show.
struct Joints {
  Mechanism mechanism;
  RowMatrix values;  // N x legs
};

Joints joints_of(const Mechanism& mechanism, const Setup& setup, const Observations& observations) {
  RowMatrix parameters = setup.parameters;
  RowMatrix values = observations.readings.values;
  for (Index leg = 0; leg < parameters.rows(); ++leg) {
    const CurvedSensor sensor = setup.sensor(leg);
    for (Index i = 0; i < values.rows(); ++i) {
      values(i, leg) = sensor.active_joint(values(i, leg));
    }
  }
  parameters.rightCols(2).col(0).setOnes();
  parameters.rightCols(2).col(1).setZero();
  return {mechanism.with_parameters(parameters), values};
}

// Forward kinematics of the rows whose readings are complete, by continuation from home, and then
// from the nearest row that has its pose. NaN for the others.
RowMatrix continued(const Joints& joints, ConstVector home) {
  constexpr int kSteps = 8;
  const Mechanism& mechanism = joints.mechanism;
  const Index coordinates = coordinate_count(mechanism.pose_space());
  RowMatrix found = RowMatrix::Constant(joints.values.rows(), coordinates, kUnknown);
  const RowMatrix home_row = home.transpose();
  const RowMatrix at_home = inverse_kinematics(mechanism, home_row);
  std::vector<Index> rows;
  for (Index i = 0; i < joints.values.rows(); ++i) {
    if (joints.values.row(i).allFinite()) {
      rows.push_back(i);
    }
  }
  const auto count = static_cast<Index>(rows.size());
  if (count == 0 || !at_home.allFinite()) {
    return found;
  }
  RowMatrix ways(count, mechanism.leg_count());  // from home, the short way round
  for (Index k = 0; k < count; ++k) {
    ways.row(k) = joints.values.row(rows[static_cast<std::size_t>(k)]) - at_home;
    for (Index leg = 0; leg < ways.cols(); ++leg) {
      if (is_angle(mechanism.model(leg).info().active_joint)) {
        ways(k, leg) = wrap_angle(ways(k, leg));
      }
    }
  }
  RowMatrix poses = home_row.replicate(count, 1);
  std::vector<bool> reached(static_cast<std::size_t>(count), true);
  for (int step = 1; step <= kSteps; ++step) {
    const RowMatrix readings =
        (ways * (static_cast<double>(step) / kSteps)).rowwise() + at_home.row(0);
    const auto result = forward_kinematics(mechanism, readings, poses);
    for (Index k = 0; k < count; ++k) {
      if (result.status[static_cast<std::size_t>(k)] == ForwardStatus::converged) {
        poses.row(k) = result.poses.row(k);
      } else {
        reached[static_cast<std::size_t>(k)] = false;
      }
    }
  }
  bool more = true;
  while (more) {
    more = false;
    for (Index k = 0; k < count; ++k) {
      if (reached[static_cast<std::size_t>(k)]) {
        continue;
      }
      Index nearest = -1;
      double least = std::numeric_limits<double>::infinity();
      for (Index other = 0; other < count; ++other) {
        const double distance = (ways.row(other) - ways.row(k)).squaredNorm();
        if (reached[static_cast<std::size_t>(other)] && distance < least) {
          least = distance;
          nearest = other;
        }
      }
      if (nearest < 0) {
        break;
      }
      const RowMatrix readings = ways.row(k) + at_home.row(0);
      const RowMatrix from = poses.row(nearest);
      const auto result = forward_kinematics(mechanism, readings, from);
      if (result.status.front() == ForwardStatus::converged) {
        poses.row(k) = result.poses.row(0);
        reached[static_cast<std::size_t>(k)] = more = true;
      }
    }
  }
  for (Index k = 0; k < count; ++k) {
    if (reached[static_cast<std::size_t>(k)]) {
      found.row(rows[static_cast<std::size_t>(k)]) = poses.row(k);
    }
  }
  return found;
}

// Poses whose every coordinate was observed, NaN otherwise.
RowMatrix complete_rows(const Observed& observed, Index count, Index coordinates) {
  RowMatrix rows = RowMatrix::Constant(count, coordinates, kUnknown);
  for (Index i = 0; observed.any() && i < count; ++i) {
    if (observed.values.row(i).allFinite()) {
      rows.row(i) = observed.values.row(i);
    }
  }
  return rows;
}

// Poses of the robot in its own frame, from what it says of itself.
RowMatrix robot_poses(const Mechanism& mechanism, const Setup& setup,
                      const Observations& observations, ConstVector home) {
  RowMatrix poses = complete_rows(observations.reported, observations.count(),
                                  coordinate_count(mechanism.pose_space()));
  if (poses.allFinite()) {
    return poses;
  }
  const RowMatrix computed = continued(joints_of(mechanism, setup, observations), home);
  for (Index i = 0; i < poses.rows(); ++i) {
    if (!poses.row(i).allFinite()) {
      poses.row(i) = computed.row(i);
    }
  }
  return poses;
}

// Of a planar problem, about Z.
Eigen::Matrix3d nearest_rotation(Eigen::Matrix3d matrix, bool planar) {
  if (planar) {
    matrix.row(2).setZero();
    matrix.col(2).setZero();
    matrix(2, 2) = matrix.norm() + 1;
  }
  const RowMatrix m = matrix;
  const RightSingular svd = right_singular(m);  // m = U S V'
  const Eigen::Matrix3d v = svd.vectors;
  Eigen::Matrix3d u = matrix * v;
  u.col(0).normalize();
  u.col(1) -= u.col(0) * u.col(0).dot(u.col(1));
  u.col(1) = u.col(1).norm() > 0 ? u.col(1).normalized() : u.col(0).unitOrthogonal();
  u.col(2) = u.col(0).cross(u.col(1)) * (v.determinant() < 0 ? -1 : 1);
  return u * v.transpose();
}

// Of the least squares of rows x - values.
Vector shortest_solution(const RowMatrix& rows, const Vector& values) {
  return symmetric_inverse(product(rows.transpose(), rows)).matrix * (rows.transpose() * values);
}

// A pair of the robot's pose P and what the device saw of it, Y = B P T.
struct SeenPose {
  Frame robot, seen;
};

struct FramePair {
  Frame base, target;
};

// Positions alone: the rotation between two clouds of points (Kabsch) and the lever arm by turns.
FramePair by_positions(const std::vector<SeenPose>& pairs, const FramePair& given, bool target,
                       bool planar) {
  FramePair found = given;
  constexpr int kAlternations = 50;
  for (int i = 0; i < kAlternations; ++i) {
    Eigen::Vector3d mean_robot = Eigen::Vector3d::Zero();
    Eigen::Vector3d mean_seen = Eigen::Vector3d::Zero();
    for (const SeenPose& pair : pairs) {
      mean_robot += pair.robot.position + pair.robot.rotation * found.target.position;
      mean_seen += pair.seen.position;
    }
    mean_robot /= static_cast<double>(pairs.size());
    mean_seen /= static_cast<double>(pairs.size());
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (const SeenPose& pair : pairs) {
      const Eigen::Vector3d at =
          pair.robot.position + pair.robot.rotation * found.target.position - mean_robot;
      moment += (pair.seen.position - mean_seen) * at.transpose();
    }
    found.base.rotation = nearest_rotation(moment, planar);
    found.base.position = mean_seen - found.base.rotation * mean_robot;
    if (!target) {
      return found;
    }
    // b and t, linear for this rotation.
    RowMatrix rows(3 * static_cast<Index>(pairs.size()), 6);
    Vector values(rows.rows());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto at = 3 * static_cast<Index>(k);
      rows.block<3, 3>(at, 0).setIdentity();
      rows.block<3, 3>(at, 3) = found.base.rotation * pairs[k].robot.rotation;
      values.segment<3>(at) =
          pairs[k].seen.position - found.base.rotation * pairs[k].robot.position;
    }
    const Vector solution = shortest_solution(rows, values);
    found.base.position = solution.head<3>();
    found.target.position = solution.tail<3>();
  }
  return found;
}

// Dominant singular pair of the mean of R_P (x) R_Y: vec(R_B) and vec(R_T').
FramePair by_orientations(const std::vector<SeenPose>& pairs, const FramePair& given) {
  RowMatrix mean = RowMatrix::Zero(9, 9);
  for (const SeenPose& pair : pairs) {
    for (Index i = 0; i < 3; ++i) {
      for (Index j = 0; j < 3; ++j) {
        mean.block<3, 3>(3 * i, 3 * j) += pair.robot.rotation(i, j) * pair.seen.rotation;
      }
    }
  }
  const RightSingular svd = right_singular(mean);
  const Vector right = svd.vectors.col(0);
  const Vector left = mean * right;
  Eigen::Matrix3d target = Eigen::Map<const Eigen::Matrix3d>(right.data());
  Eigen::Matrix3d base = Eigen::Map<const Eigen::Matrix3d>(left.data());
  const double sign = base.determinant() < 0 ? -1 : 1;
  FramePair found = given;
  found.base.rotation = nearest_rotation(sign * base, false);
  found.target.rotation = nearest_rotation((sign * target).transpose(), false);
  return found;
}

// p_Y = b + M p_P + R_Y tau, linear in b, M and tau = R_T' t.
FramePair by_lever_arm(const std::vector<SeenPose>& pairs, const FramePair& given, bool planar) {
  RowMatrix rows = RowMatrix::Zero(3 * static_cast<Index>(pairs.size()), 15);
  Vector values(rows.rows());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto at = 3 * static_cast<Index>(k);
    rows.block<3, 3>(at, 0).setIdentity();
    for (Index i = 0; i < 3; ++i) {
      rows.block<1, 3>(at + i, 3 + 3 * i) = pairs[k].robot.position.transpose();
    }
    rows.block<3, 3>(at, 12) = pairs[k].seen.rotation;
    values.segment<3>(at) = pairs[k].seen.position;
  }
  const Vector solution = shortest_solution(rows, values);
  Eigen::Matrix3d m;
  for (Index i = 0; i < 3; ++i) {
    m.row(i) = solution.segment<3>(3 + 3 * i);
  }
  FramePair found = given;
  found.base.rotation = nearest_rotation(m, planar);
  return found;
}

// The target's rotation and both positions for the base's rotation.
FramePair completed(const std::vector<SeenPose>& pairs, FramePair frames, bool target) {
  if (target) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const SeenPose& pair : pairs) {
      const Eigen::Matrix3d turned = frames.base.rotation * pair.robot.rotation;
      sum += turned.transpose() * pair.seen.rotation;
    }
    frames.target.rotation = nearest_rotation(sum, false);
  }
  const Index columns = target ? 6 : 3;
  RowMatrix rows(3 * static_cast<Index>(pairs.size()), columns);
  Vector values(rows.rows());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto at = 3 * static_cast<Index>(k);
    const Eigen::Matrix3d turned = frames.base.rotation * pairs[k].robot.rotation;
    rows.block<3, 3>(at, 0).setIdentity();
    values.segment<3>(at) = pairs[k].seen.position - frames.base.rotation * pairs[k].robot.position;
    if (target) {
      rows.block<3, 3>(at, 3) = turned;
    } else {
      values.segment<3>(at) -= turned * frames.target.position;
    }
  }
  const Vector solution = shortest_solution(rows, values);
  frames.base.position = solution.head<3>();
  if (target) {
    frames.target.position = solution.tail<3>();
  }
  return frames;
}

}  // namespace

RowMatrix starting_poses(const Mechanism& mechanism, const Setup& setup,
                         const Observations& observations, ConstVector home) {
  observations.check(mechanism, setup);
  const PoseSpace space = mechanism.pose_space();
  const Index count = observations.count();
  RowMatrix poses = complete_rows(observations.reported, count, coordinate_count(space));
  const RowMatrix seen = complete_rows(observations.poses, count, coordinate_count(space));
  const Frame from_device = setup.base.inverse();
  const Frame to_platform = setup.target.inverse();
  for (Index i = 0; i < count; ++i) {
    if (!poses.row(i).allFinite() && seen.row(i).allFinite()) {
      pose_of_frame(space, from_device * frame_of_pose(space, seen.row(i).data()) * to_platform,
                    poses.row(i).data());
    }
  }
  if (!poses.allFinite()) {
    const RowMatrix computed = continued(joints_of(mechanism, setup, observations), home);
    for (Index i = 0; i < count; ++i) {
      if (!poses.row(i).allFinite()) {
        poses.row(i) = computed.row(i);
      }
    }
  }
  return poses;
}

Setup with_starting_frames(const Mechanism& mechanism, const Setup& setup,
                           const Observations& observations, ConstVector home, bool base,
                           bool target) {
  constexpr std::size_t kLeast = 3;
  observations.check(mechanism, setup);
  const PoseSpace space = mechanism.pose_space();
  const Index dimensions = position_size(space);
  const bool planar = dimensions == 2;
  const RowMatrix robot = robot_poses(mechanism, setup, observations, home);
  std::vector<SeenPose> pairs;
  std::vector<Index> rows;
  bool all_turned = true;
  for (Index i = 0; observations.poses.any() && i < observations.count(); ++i) {
    const auto seen = observations.poses.values.row(i);
    if (!robot.row(i).allFinite() || !seen.head(dimensions).allFinite()) {
      continue;
    }
    const Index rest = seen.size() - dimensions;
    const bool turned = rest > 0 && seen.tail(rest).allFinite();
    if (dimensions == 0 && !turned) {
      continue;
    }
    Vector known = identity_pose(space);
    known.head(dimensions) = seen.head(dimensions);
    if (turned) {
      known = seen;
    }
    all_turned = all_turned && turned;
    pairs.push_back(
        {frame_of_pose(space, robot.row(i).data()), frame_of_pose(space, known.data())});
    rows.push_back(i);
  }
  if (pairs.size() < kLeast) {
    throw InvalidInput("the frames need at least " + std::to_string(kLeast) + " poses whose " +
                       (dimensions > 0 ? "position" : "orientation") +
                       " was measured and that can be computed from the readings; there are " +
                       std::to_string(pairs.size()));
  }

  const FramePair given{setup.base, setup.target};
  std::vector<FramePair> starts{given};
  if (base) {
    if (dimensions > 0) {
      starts.push_back(by_positions(pairs, given, target, planar));
    }
    if (all_turned) {
      starts.push_back(completed(pairs, starts.back(), target));
      if (target) {
        if (!planar) {  // all turns about one axis leave it open
          starts.push_back(completed(pairs, by_orientations(pairs, given), true));
        }
        if (dimensions > 0) {
          starts.push_back(completed(pairs, by_lever_arm(pairs, given, planar), true));
        }
      } else {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (const SeenPose& pair : pairs) {
          const Eigen::Matrix3d target_turned = pair.robot.rotation * given.target.rotation;
          sum += pair.seen.rotation * target_turned.transpose();
        }
        FramePair turned = given;
        turned.base.rotation = nearest_rotation(sum, false);
        starts.push_back(completed(pairs, turned, false));
      }
    }
  } else if (target && all_turned) {
    FramePair turned = completed(pairs, given, true);
    turned.base = given.base;
    starts.push_back(turned);
  }

  // Refined with the robot's poses as they are, every start; planar rotations stay planar.
  Observations alone;
  alone.readings.values =
      RowMatrix::Constant(static_cast<Index>(rows.size()), mechanism.leg_count(), kUnknown);
  alone.readings.deviations = RowMatrix::Zero(alone.readings.values.rows(), mechanism.leg_count());
  alone.poses.values.resize(alone.readings.values.rows(), robot.cols());
  alone.poses.deviations.resize(alone.readings.values.rows(), mechanism.dof());
  alone.reported.values = alone.poses.values;
  alone.reported.deviations = RowMatrix::Zero(alone.readings.values.rows(), mechanism.dof());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto at = static_cast<Index>(k);
    alone.poses.values.row(at) = observations.poses.values.row(rows[k]);
    alone.poses.deviations.row(at) = observations.poses.deviations.row(rows[k]);
    alone.reported.values.row(at) = robot.row(rows[k]);
  }
  // The robot's poses are exact here, so what was measured of them cannot be.
  alone.poses.deviations = alone.poses.deviations.unaryExpr(
      [](double deviation) { return deviation == 0 ? 1 : deviation; });
  const UnknownList list(setup);
  Layout layout;
  layout.column.assign(static_cast<std::size_t>(list.size()), -1);
  Index columns = 0;
  for (const bool of_base : {true, false}) {
    for (const Index slot : frame_slots(space)) {
      const Index scalar = (of_base ? list.base() : list.target()) + slot;
      if (of_base ? base : target) {
        layout.column[static_cast<std::size_t>(scalar)] = columns++;
      }
    }
  }
  // Loose, for what the poses do not show, such as the turn of a target that is only a point.
  layout.prior = Vector::Constant(columns, 1e3);
  // The fit goes on from there: last digits of a bad start are not worth waiting for.
  constexpr SolverOptions kBriefly{12};
  Setup best = setup;
  double least = std::numeric_limits<double>::infinity();
  for (const FramePair& start : starts) {
    Setup trial = setup;
    trial.base = start.base;
    trial.target = start.target;
    LatentProblem problem(mechanism, alone, layout, trial, alone.reported.values,
                          std::vector<bool>(rows.size(), false), RobustLoss(), 1);
    minimise(problem, kBriefly);
    NormalEquations end;
    if (problem.linearise(end) && end.cost < least) {
      least = end.cost;
      best = problem.setup();
    }
  }
  return best;
}

}  // namespace symkin
