// SPDX-License-Identifier: MIT

// fit_jointly beside a plain Ceres program on the same problem, the frames unknown: a hexapod whose
// legs have priors, measured by a device that stands somewhere. The program is what one writes with
// Ceres' manual at hand: residuals by autodiff, the poses eliminated by DENSE_SCHUR. Both have the
// same data, the same start and the same priors.
//
// Processor time of one thread, the least of some runs, their ratio, and the largest difference of
// the estimated parameters in standard deviations: where Ceres ends by the tolerances that it is
// timed with, and by its tightest.

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <vector>

#include "support/mechanisms.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/random.hpp"

namespace symkin::testing {
namespace {

constexpr double kTolerance = 1e-3, kReading = 5e-3, kPosition = 1e-4, kTurn = 1e-4;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct Task {
  Mechanism nominal = hexapod();
  Setup setup = Setup::of(nominal);
  Layout layout;
  Observations observations;
  RowMatrix start;
};

void free_scalars(Layout& layout, Index first, Index count, double prior, Vector& priors) {
  for (Index i = first; i < first + count; ++i) {
    layout.column[static_cast<std::size_t>(i)] = priors.size();
    priors.conservativeResize(priors.size() + 1);
    priors.tail<1>().setConstant(prior);
  }
}

Frame disturbed(const Frame& frame, double size, Random& random) {
  Eigen::Matrix<double, 6, 1> step;
  std::generate(step.begin(), step.end(), [&] { return size * random.normal(); });
  return moved(frame, step);
}

// Poses as a device sees them, or three reflectors on the platform, a fifth of whose coordinates
// are missing.
Task task(Index count, bool reflectors) {
  Task task;
  Random random(3);
  const Mechanism actual = disturb(task.nominal, {kTolerance, kTolerance, kTolerance}, 7);
  const RowMatrix poses = sample_workspace(task.nominal, hexapod_workspace(), count, 3).poses;
  const Frame far{{0.9, -0.4, 0.5}, rotation_of({0.3, -0.8, 1.1})};
  const Frame target{{0.02, 0.05, 0.04}, rotation_of({0.1, 0.05, -0.12})};
  RowMatrix points(3, 3);
  points << 0.1, 0, 0.05, -0.06, 0.09, 0.02, -0.05, -0.1, 0.07;
  Setup& setup = task.setup;
  setup.base = disturbed(far, 2e-3, random);
  setup.target = reflectors ? Frame() : disturbed(target, 2e-3, random);
  if (reflectors) {
    setup.points = points.unaryExpr([&](double x) { return x + 1e-3 * random.normal(); });
  }
  const UnknownList list(setup);
  Vector priors(0);
  task.layout.column.assign(static_cast<std::size_t>(list.size()), -1);
  for (Index leg = 0; leg < 6; ++leg) {
    free_scalars(task.layout, list.leg(leg), 8, kTolerance, priors);
  }
  const double none = std::numeric_limits<double>::infinity();
  free_scalars(task.layout, list.base(), 6, none, priors);
  free_scalars(task.layout, reflectors ? list.point(0) : list.target(), reflectors ? 9 : 6, none,
               priors);
  task.layout.prior = priors;

  const auto noisy = [&](double x, double deviation) { return x + deviation * random.normal(); };
  Observations& observed = task.observations;
  observed.readings = {inverse_kinematics(actual, poses), RowMatrix::Constant(count, 6, kReading)};
  for (double& reading : observed.readings.values.reshaped()) {
    reading = noisy(reading, kReading);
  }
  task.start = poses;
  if (reflectors) {
    observed.points = {RowMatrix(count, 9), RowMatrix::Constant(count, 9, kPosition)};
  } else {
    observed.poses = {RowMatrix(count, 7), RowMatrix::Constant(count, 6, kPosition)};
    observed.poses.deviations.rightCols(3).setConstant(kTurn);
  }
  for (Index i = 0; i < count; ++i) {
    const Frame pose = far * frame_of_pose(PoseSpace::spatial, poses.row(i).data());
    if (reflectors) {
      for (Index k = 0; k < 9; ++k) {
        const double at = (pose.position + pose.rotation * points.row(k / 3).transpose())[k % 3];
        observed.points.values(i, k) = random.uniform() < 0.2 ? kMissing : noisy(at, kPosition);
      }
      const Frame near =
          disturbed(frame_of_pose(PoseSpace::spatial, poses.row(i).data()), 2e-3, random);
      pose_of_frame(PoseSpace::spatial, near, task.start.row(i).data());
    } else {
      const Frame seen = disturbed(pose * target, kPosition, random);
      pose_of_frame(PoseSpace::spatial, seen, observed.poses.values.row(i).data());
      pose_of_frame(PoseSpace::spatial, setup.base.inverse() * seen * setup.target.inverse(),
                    task.start.row(i).data());
    }
  }
  return task;
}

JointFit by_symkin(const Task& task) {
  JointOptions options;
  options.start = task.start;
  options.rows = false;
  return fit_jointly(task.nominal, task.setup, task.observations, task.layout, options);
}

// The plain program. A frame is six numbers: position and rotation vector.
template <typename T>
void point_at(const T* spherical, T* point) {
  point[0] = spherical[0] * sin(spherical[1]) * cos(spherical[2]);
  point[1] = spherical[0] * sin(spherical[1]) * sin(spherical[2]);
  point[2] = spherical[0] * cos(spherical[1]);
}

template <typename T>
void carry(const T* frame, const T* point, T* carried) {
  ceres::AngleAxisRotatePoint(frame + 3, point, carried);
  for (int i = 0; i < 3; ++i) {
    carried[i] += frame[i];
  }
}

struct ReadingError {
  double reading;
  template <typename T>
  bool operator()(const T* leg, const T* pose, T* residual) const {
    T base[3], on_platform[3], platform[3];
    point_at(leg, base);
    point_at(leg + 3, on_platform);
    carry(pose, on_platform, platform);
    T square(0);
    for (int i = 0; i < 3; ++i) {
      square += (platform[i] - base[i]) * (platform[i] - base[i]);
    }
    residual[0] = ((sqrt(square) - leg[7]) / leg[6] - reading) / kReading;
    return true;
  }
};

struct PoseError {
  Frame measured;
  template <typename T>
  bool operator()(const T* pose, const T* base, const T* target, T* residual) const {
    T inner[3], seen[3], turn[4], of_base[4], of_target[4], measured_turn[4], between[4], off[4];
    carry(pose, target, inner);
    carry(base, inner, seen);
    ceres::AngleAxisToQuaternion(pose + 3, turn);
    ceres::AngleAxisToQuaternion(base + 3, of_base);
    ceres::AngleAxisToQuaternion(target + 3, of_target);
    ceres::QuaternionProduct(of_base, turn, between);
    ceres::QuaternionProduct(between, of_target, turn);
    const Eigen::Quaterniond back(measured.rotation.transpose());
    measured_turn[0] = T(back.w());
    for (int i = 0; i < 3; ++i) {
      measured_turn[i + 1] = T(back.vec()[i]);
    }
    ceres::QuaternionProduct(turn, measured_turn, off);
    ceres::QuaternionToAngleAxis(off, residual + 3);
    for (int i = 0; i < 3; ++i) {
      residual[i] = (seen[i] - measured.position[i]) / kPosition;
      residual[3 + i] /= T(kTurn);
    }
    return true;
  }
};

struct CoordinateError {
  int axis;
  double measured;
  template <typename T>
  bool operator()(const T* pose, const T* base, const T* point, T* residual) const {
    T inner[3], seen[3];
    carry(pose, point, inner);
    carry(base, inner, seen);
    residual[0] = (seen[axis] - measured) / kPosition;
    return true;
  }
};

struct Prior {
  Vector nominal;
  template <typename T>
  bool operator()(const T* leg, T* residual) const {
    for (int i = 0; i < 8; ++i) {
      residual[i] = (leg[i] - nominal[i]) / kTolerance;
    }
    return true;
  }
};

void write(const Frame& frame, double* to) {
  const Eigen::AngleAxisd turn(frame.rotation);
  Eigen::Map<Eigen::Vector3d>{to} = frame.position;
  Eigen::Map<Eigen::Vector3d>{to + 3} = turn.angle() * turn.axis();
}

template <int... kSizes, typename Error>
ceres::CostFunction* cost(const Error& error) {
  return new ceres::AutoDiffCostFunction<Error, kSizes...>(new Error(error));
}

// The legs' parameters where it ends.
RowMatrix by_ceres(const Task& task, bool tightest, int& steps) {
  const Observations& observed = task.observations;
  RowMatrix legs = task.setup.parameters, points = task.setup.points, poses(task.start.rows(), 6);
  double base[6], target[6];
  write(task.setup.base, base);
  write(task.setup.target, target);
  ceres::Problem problem;
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Index i = 0; i < poses.rows(); ++i) {
    double* const pose = poses.row(i).data();
    write(frame_of_pose(PoseSpace::spatial, task.start.row(i).data()), pose);
    for (Index leg = 0; leg < 6; ++leg) {
      problem.AddResidualBlock(cost<1, 8, 6>(ReadingError{observed.readings.values(i, leg)}),
                               nullptr, legs.row(leg).data(), pose);
    }
    if (observed.poses.any()) {
      const Frame seen = frame_of_pose(PoseSpace::spatial, observed.poses.values.row(i).data());
      problem.AddResidualBlock(cost<6, 6, 6, 6>(PoseError{seen}), nullptr, pose, base, target);
    }
    for (Index k = 0; k < observed.points.values.cols(); ++k) {
      if (std::isfinite(observed.points.values(i, k))) {
        problem.AddResidualBlock(cost<1, 6, 6, 3>(CoordinateError{static_cast<int>(k % 3),
                                                                  observed.points.values(i, k)}),
                                 nullptr, pose, base, points.row(k / 3).data());
      }
    }
    order->AddElementToGroup(pose, 0);
  }
  for (Index leg = 0; leg < 6; ++leg) {
    problem.AddResidualBlock(cost<8, 8>(Prior{task.setup.parameters.row(leg)}), nullptr,
                             legs.row(leg).data());
  }
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  for (double* const block : blocks) {
    if (!order->IsMember(block)) {
      order->AddElementToGroup(block, 1);
    }
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = order;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  options.max_num_iterations = 100;
  if (tightest) {
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
    // What the last steps gain is lost in the cost's rounding: without these it ends before them.
    options.use_nonmonotonic_steps = true;
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  steps = summary.num_successful_steps;
  return legs;
}

// Milliseconds of processor time.
template <typename Work>
double time_of(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void compare(const char* name, Index count, bool reflectors, int runs) {
  const Task task = testing::task(count, reflectors);
  const JointFit ours = by_symkin(task);
  const Vector deviations = ours.covariance.diagonal().head(48).cwiseSqrt();
  int steps = 0;
  const auto difference = [&](bool tightest) {
    const RowMatrix off = by_ceres(task, tightest, steps) - ours.setup.parameters;
    return Eigen::Map<const Vector>(off.data(), off.size())
        .cwiseQuotient(deviations)
        .lpNorm<Eigen::Infinity>();
  };
  const double at_tightest = difference(true), at_end = difference(false);
  double symkin = std::numeric_limits<double>::infinity();
  double ceres = symkin;
  for (int run = 0; run < runs; ++run) {
    for (int again = 0; again < 5; ++again) {
      symkin = std::min(symkin, time_of([&] { by_symkin(task); }));
    }
    ceres = std::min(ceres, time_of([&] { by_ceres(task, false, steps); }));
  }
  std::printf("%-12s %6td %10.3f %6d %9.2f %6d %6.1f %10.1e %10.1e\n", name, count, symkin,
              ours.iterations, ceres, steps, ceres / symkin, at_end, at_tightest);
}

}  // namespace
}  // namespace symkin::testing

int main() {
  using symkin::testing::compare;
  std::printf("%-12s %6s %10s %6s %9s %6s %6s %10s %10s\n", "", "poses", "symkin, ms", "steps",
              "Ceres, ms", "steps", "ratio", "difference", "tightest");
  compare("full poses", 108, false, 20);
  compare("full poses", 1000, false, 5);
  compare("reflectors", 108, true, 20);
  compare("reflectors", 1000, true, 5);
}
