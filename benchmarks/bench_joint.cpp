// SPDX-License-Identifier: MIT

// fit_jointly beside Ceres on the same problem: every parameter of every leg from poses that were
// measured in full and readings, the true poses unknown. Ceres gets the same rows, made for all
// poses at once by symkin's kernels, pose blocks that it eliminates by a Schur complement, and a
// dense factorisation of the rest. Both begin at the drawing and the measured poses.
//
// Processor time of one thread, the least of some runs, and the largest difference of the estimates
// in standard deviations: as Ceres ends, which is where its cost cannot be told from rounding, and
// two of Newton's steps on its residuals further, which is the optimum.

#include <ceres/ceres.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <memory>
#include <vector>

#include "support/mechanisms.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/simulation.hpp"

namespace symkin::testing {
namespace {

struct Task {
  Mechanism nominal;
  Setup setup;
  Layout layout;
  Observations observations;
};

Task task(const Mechanism& nominal, const WorkspaceOptions& workspace, Index count) {
  const MeasurementNoise noise{1e-4, 1e-4, 5e-5};
  const RowMatrix poses = sample_workspace(nominal, workspace, count + 20, 3).poses;
  const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
  const MeasurementSet measured =
      simulate(actual, nominal, {{-1, poses, count}}, noise, 5).measurements;
  const Setup setup = Setup::of(nominal);
  Observations observations;
  observations.readings = {measured.readings,
                           RowMatrix::Constant(count, nominal.leg_count(), noise.reading)};
  observations.poses = {measured.poses,
                        RowMatrix::Constant(count, nominal.dof(), noise.orientation)};
  observations.poses.deviations.leftCols(position_size(nominal.pose_space()))
      .setConstant(noise.position);
  return {nominal, setup, Layout::of_all_parameters(nominal, setup), observations};
}

JointFit by_symkin(const Task& task) {
  JointOptions options;
  options.start = task.observations.poses.values;
  options.rows = false;
  return fit_jointly(task.nominal, task.setup, task.observations, task.layout, options);
}

// Readings of all legs at the poses that Ceres asks about, with their derivatives. A pose is known
// by the tangent vector that moves the measured one to it.
class Readings final : public ceres::EvaluationCallback {
 public:
  explicit Readings(const Task& task)
      : task_(task),
        parameters(task.setup.parameters),
        tangents(RowMatrix::Zero(task.observations.count(), task.nominal.dof())),
        misfits(task.observations.count(), task.nominal.leg_count()),
        rows(static_cast<std::size_t>(task.nominal.leg_count())),
        poses_(task.observations.poses.values) {}

  void PrepareForEvaluation(bool derivatives, bool moved) override {
    const PoseSpace space = task_.nominal.pose_space();
    for (Index i = 0; moved && i < poses_.rows(); ++i) {
      poses_.row(i) = task_.observations.poses.values.row(i);
      move_pose(space, tangents.row(i).data(), poses_.row(i).data());
    }
    Vector values(poses_.rows());
    Vector differences(poses_.rows());
    for (Index leg = 0; leg < misfits.cols(); ++leg) {
      const LegModel& model = task_.nominal.model(leg);
      const Vector of_leg = parameters.row(leg);
      const auto read = task_.observations.readings.values.col(leg);
      model.inverse_kinematics(of_leg, task_.nominal.leg(leg).working_mode, poses_, values);
      model.reading_differences(of_leg, values, read, differences);
      misfits.col(leg) = differences;
      if (!derivatives) {
        continue;
      }
      ClosureRows& all = rows[static_cast<std::size_t>(leg)];
      model.linearise(of_leg, poses_, read + differences, all);
      for (Index i = 0; i < poses_.rows(); ++i) {
        all.by_parameters.row(i) /= -all.by_reading[i];
        all.by_pose.row(i) /= -all.by_reading[i];
        if (space == PoseSpace::spatial) {
          all.by_pose.row(i).tail<3>() *= left_jacobian(tangents.row(i).tail<3>());
        }
      }
    }
  }

 private:
  // exp(w + d) = exp(J d) exp(w) to first order.
  static Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
    Eigen::Matrix3d cross;
    cross << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
    return Eigen::Matrix3d::Identity() + (0.5 - w.squaredNorm() / 24) * cross +
           (1.0 / 6 - w.squaredNorm() / 120) * cross * cross;
  }

  const Task& task_;

 public:
  RowMatrix parameters;  // legs x p, the blocks of the legs
  RowMatrix tangents;    // N x dof, the blocks of the poses
  RowMatrix misfits;     // N x legs
  std::vector<ClosureRows> rows;

 private:
  RowMatrix poses_;
};

class ReadingError final : public ceres::CostFunction {
 public:
  ReadingError(const Readings& readings, Index pose, Index leg, double deviation)
      : readings_(readings), pose_(pose), leg_(leg), deviation_(deviation) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(readings.tangents.cols()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(readings.parameters.cols()));
  }

  bool Evaluate(double const* const* /*parameters*/, double* residuals,
                double** jacobians) const override {
    residuals[0] = readings_.misfits(pose_, leg_) / deviation_;
    if (jacobians != nullptr) {
      const ClosureRows& rows = readings_.rows[static_cast<std::size_t>(leg_)];
      copy(rows.by_pose, jacobians[0]);
      copy(rows.by_parameters, jacobians[1]);
    }
    return std::isfinite(residuals[0]);
  }

 private:
  void copy(const RowMatrix& from, double* to) const {
    if (to != nullptr) {
      Eigen::Map<Eigen::RowVectorXd>(to, from.cols()) = from.row(pose_) / deviation_;
    }
  }

  const Readings& readings_;
  Index pose_, leg_;
  double deviation_;
};

class PoseError final : public ceres::CostFunction {
 public:
  explicit PoseError(const Vector& deviations) : deviations_(deviations) {
    set_num_residuals(static_cast<int>(deviations.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(deviations.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Index n = deviations_.size();
    Eigen::Map<Vector>(residuals, n) =
        Eigen::Map<const Vector>(parameters[0], n).cwiseQuotient(deviations_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMatrix>(jacobians[0], n, n) = deviations_.cwiseInverse().asDiagonal();
    }
    return true;
  }

 private:
  Vector deviations_;
};

// The problem of Ceres, and its solution.
class ByCeres {
 public:
  explicit ByCeres(const Task& task) : readings(task), problem_(with(readings)) {
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Index i = 0; i < task.observations.count(); ++i) {
      double* const tangent = readings.tangents.row(i).data();
      problem_.AddResidualBlock(new PoseError(task.observations.poses.deviations.row(i)), nullptr,
                                tangent);
      for (Index leg = 0; leg < task.nominal.leg_count(); ++leg) {
        problem_.AddResidualBlock(
            new ReadingError(readings, i, leg, task.observations.readings.deviations(i, leg)),
            nullptr, tangent, readings.parameters.row(leg).data());
      }
      order->AddElementToGroup(tangent, 0);
    }
    for (Index leg = 0; leg < task.nominal.leg_count(); ++leg) {
      order->AddElementToGroup(readings.parameters.row(leg).data(), 1);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = order;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    options.initial_trust_region_radius = 1e16;  // as good as Gauss-Newton from the first step
    options.max_trust_region_radius = 1e32;
    options.function_tolerance = options.gradient_tolerance = 0;
    options.parameter_tolerance = 1e-12;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    steps = summary.num_successful_steps;
  }

  void newton() {
    ceres::Problem::EvaluateOptions all;
    std::vector<double> residuals;
    ceres::CRSMatrix rows;
    problem_.GetParameterBlocks(&all.parameter_blocks);
    problem_.Evaluate(all, nullptr, &residuals, nullptr, &rows);
    const Eigen::SparseMatrix<double> jacobian =
        Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
            rows.num_rows, rows.num_cols, static_cast<Index>(rows.values.size()), rows.rows.data(),
            rows.cols.data(), rows.values.data());
    const Eigen::SparseMatrix<double> information = jacobian.transpose() * jacobian;
    const Vector gradient =
        jacobian.transpose() * Eigen::Map<const Vector>(residuals.data(), rows.num_rows);
    const Vector step =
        Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(information).solve(gradient);
    Index first = 0;
    for (double* const block : all.parameter_blocks) {
      const Index size = problem_.ParameterBlockSize(block);
      Eigen::Map<Vector>(block, size) -= step.segment(first, size);
      first += size;
    }
  }

  Readings readings;
  int steps;

 private:
  static ceres::Problem::Options with(Readings& readings) {
    ceres::Problem::Options options;
    options.evaluation_callback = &readings;
    options.disable_all_safety_checks = true;
    return options;
  }

  ceres::Problem problem_;
};

// Milliseconds of processor time.
template <typename Work>
double time_of(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void compare(const char* name, const Task& task, int runs) {
  const JointFit ours = by_symkin(task);
  const Vector deviations = ours.covariance.diagonal().cwiseSqrt();
  ByCeres theirs(task);
  const auto difference = [&] {
    const RowMatrix off = theirs.readings.parameters - ours.setup.parameters;
    return Eigen::Map<const Vector>(off.data(), off.size())
        .cwiseQuotient(deviations)
        .lpNorm<Eigen::Infinity>();
  };
  const double at_end = difference();
  theirs.newton();
  theirs.newton();
  double symkin = std::numeric_limits<double>::infinity();
  double ceres = symkin;
  for (int run = 0; run < runs; ++run) {
    for (int again = 0; again < 10; ++again) {
      symkin = std::min(symkin, time_of([&] { by_symkin(task); }));
    }
    ceres = std::min(ceres, time_of([&] { ByCeres solved(task); }));
  }
  std::printf("%-8s %8td %6td %10.3f %6d %9.2f %6d %6.1f %10.1e %10.1e\n", name,
              task.layout.columns(), task.observations.count(), symkin, ours.iterations, ceres,
              theirs.steps, ceres / symkin, at_end, difference());
}

}  // namespace
}  // namespace symkin::testing

int main() {
  using namespace symkin::testing;
  std::printf("%-8s %8s %6s %10s %6s %9s %6s %6s %10s %10s\n", "", "unknowns", "poses",
              "symkin, ms", "steps", "Ceres, ms", "steps", "ratio", "difference", "optimum");
  compare("3-RRR", task(paper_3rrr(), paper_workspace(), 72), 100);
  compare("hexapod", task(hexapod(), hexapod_workspace(), 504), 20);
}
