// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>

#include "support/mechanisms.hpp"
#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr Index kPoses = 11;  // no whole number of packs

struct Case {
  const char* name;
  Mechanism mechanism;
  RowMatrix poses;
  bool poses_measured, reported, points, distances, heights, frames;
  double missing;  // of readings and of all else
  double reading;  // their deviation
};

struct Observed1 {
  Setup setup;
  Observations observations;
};

Observed values(const RowMatrix& exact, double deviation, double missing, Random& random) {
  Observed observed{exact, RowMatrix::Constant(exact.rows(), exact.cols(), deviation)};
  for (double& value : observed.values.reshaped()) {
    value = random.uniform() < missing ? kMissing : value + 1e-3 * random.normal();
  }
  return observed;
}

Observed seen_poses(const Case& of, const Frame& base, const Frame& target, Random& random) {
  const PoseSpace space = of.mechanism.pose_space();
  const Index dof = of.mechanism.dof();
  Observed observed{of.poses, RowMatrix(kPoses, dof)};
  for (Index i = 0; i < kPoses; ++i) {
    const Frame seen = base * frame_of_pose(space, of.poses.row(i).data()) * target;
    pose_of_frame(space, seen, observed.values.row(i).data());
    Vector step(dof);
    for (Index k = 0; k < dof; ++k) {
      step[k] = (i == 3 ? 0.4 : 1e-3) * random.normal();  // one far off
      observed.deviations(i, k) = 1e-3 * (1 + random.uniform());
    }
    move_pose(space, step.data(), observed.values.row(i).data());
    if (random.uniform() < of.missing) {
      observed.values(i, 0) = kMissing;
    }
    if (random.uniform() < of.missing && has_orientation(space)) {
      observed.values.row(i).tail(of.poses.cols() - position_size(space)).setConstant(kMissing);
    }
  }
  return observed;
}

Observed1 observed(const Case& of) {
  Random random(5);
  const PoseSpace space = of.mechanism.pose_space();
  const Index dimensions = position_size(space);
  Observed1 made{Setup::of(of.mechanism), {}};
  Setup& setup = made.setup;
  if (of.frames) {
    Eigen::Matrix<double, 6, 1> there = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Index slot : frame_slots(space)) {
      there[slot] = 0.3 * random.normal();
    }
    setup.base = moved(Frame(), there);
    setup.target = moved(Frame(), there / 5);
  }
  setup.points = RowMatrix::Zero(3, 3);
  setup.anchors = RowMatrix::Zero(2, 3);
  setup.plane << 0.1, 0.02, -0.03, 0.05;
  setup.bed_radius = 0.7;
  for (Index i = 0; i < dimensions; ++i) {
    setup.points.col(i) << 0.1 * random.normal(), 0.1 * random.normal(), 0.1 * random.normal();
    setup.anchors.col(i) << 2 + random.normal(), 2 + random.normal();
  }
  RowMatrix points(kPoses, 3 * dimensions), distances(kPoses, 2), heights(kPoses, 1);
  for (Index i = 0; i < kPoses; ++i) {
    const Frame pose = frame_of_pose(space, of.poses.row(i).data());
    const Frame seen = setup.base * pose;
    for (Index k = 0; k < 3; ++k) {
      points.row(i).segment(k * dimensions, dimensions) =
          (seen.position + seen.rotation * setup.points.row(k).transpose()).head(dimensions);
    }
    const Eigen::Vector3d target = (seen * setup.target).position;
    distances.row(i) << (target.transpose() - setup.anchors.row(0)).norm(),
        (target.transpose() - setup.anchors.row(1)).norm();
    heights(i, 0) = (pose * setup.target).position[2] - 0.1;
  }
  Observations& all = made.observations;
  all.readings = values(inverse_kinematics(of.mechanism, of.poses), 0, of.missing, random);
  all.readings.deviations.setConstant(of.reading);
  all.poses = seen_poses(of, setup.base, setup.target, random);
  if (!of.poses_measured) {
    all.poses.values.setConstant(kMissing);
  }
  if (of.reported) {
    all.reported = seen_poses(of, Frame(), Frame(), random);
  }
  all.points = of.points ? values(points, 1e-3, of.missing, random) : Observed();
  all.distances = of.distances ? values(distances, 1e-3, of.missing, random) : Observed();
  all.heights = of.heights ? values(heights, 1e-3, of.missing, random) : Observed();
  return made;
}

// The legs' parameters and, where the frames are free, every other scalar that there is.
Layout layout_of(const Case& of, const Setup& setup) {
  const UnknownList list(setup);
  Layout layout;
  Index columns = 0;
  Index scalar = 0;
  for (const std::string& name : unknown_names(of.mechanism, setup)) {
    const bool own = scalar < list.base() && scalar % list.leg(1) < list.curvature(0);
    const bool held = !own && !of.frames;
    layout.column.push_back(name.empty() || held ? -1 : columns++);
    ++scalar;
  }
  layout.prior = Vector::Constant(columns, 1.0);
  return layout;
}

RowMatrix some_poses(const Mechanism& mechanism, const WorkspaceOptions& workspace) {
  return sample_workspace(mechanism, workspace, kPoses, 4).poses;
}

std::vector<Case> cases() {
  const Mechanism rrr = testing::paper_3rrr(), six = testing::hexapod();
  const RowMatrix planar = some_poses(rrr, testing::paper_workspace());
  const RowMatrix spatial = some_poses(six, testing::hexapod_workspace());
  const Mechanism bar = testing::five_bar();
  RowMatrix points(kPoses, 2);
  Random random(8);
  for (Index i = 0; i < kPoses; ++i) {
    points.row(i) << 0.1 * random.normal(), 0.45 + 0.03 * random.normal();
  }
  const Mechanism rps = testing::three_rps();
  RowMatrix tilted(kPoses, 7);
  for (Index i = 0; i < kPoses; ++i) {
    Frame frame{{0.01 * random.normal(), 0.01 * random.normal(), 0.7},
                rotation_of({0.1 * random.normal(), 0.1 * random.normal(), 0})};
    pose_of_frame(PoseSpace::spatial, frame, tilted.row(i).data());
  }
  return {
      {"full poses, frames held", six, spatial, true, false, false, false, false, false, 0, 1e-3},
      {"full poses, frames free", six, spatial, true, false, false, false, false, true, 0, 1e-3},
      {"planar, frames held", rrr, planar, true, false, false, false, false, false, 0, 1e-3},
      {"planar, exact readings", rrr, planar, true, false, false, false, false, true, 0, 0},
      {"points, all else held", rrr, planar, false, false, true, false, false, false, 0, 0},
      {"distances, all else held", rrr, planar, false, false, false, true, false, false, 0, 0},
      {"reported poses", six, spatial, false, true, false, false, false, true, 0, 1e-3},
      {"parts of poses", six, spatial, true, false, true, false, false, true, 0.15, 1e-3},
      {"reflectors", six, spatial, false, false, true, false, false, true, 0.1, 1e-4},
      {"reflectors, exact readings", six, spatial, false, false, true, false, false, true, 0, 0},
      {"everything", six, spatial, true, true, true, true, true, true, 0.2, 1e-3},
      {"a point", bar, points, true, false, false, true, false, true, 0.1, 1e-3},
      {"several closures a leg", rps, tilted, true, false, true, false, true, true, 0.1, 1e-3},
  };
}

TEST(LatentRows, InLanesAreThoseOfOnePoseAtATime) {
  for (const Case& of : cases()) {
    const Observed1 made = observed(of);
    const Layout layout = layout_of(of, made.setup);
    LatentProblem problem(of.mechanism, made.observations, layout, made.setup, of.poses,
                          std::vector<bool>(kPoses, false));
    NormalEquations equations;
    ASSERT_TRUE(problem.linearise(equations)) << of.name;
    const Index columns = layout.columns();
    RowMatrix information = RowMatrix::Identity(columns, columns);  // of the priors
    Vector gradient = Vector::Zero(columns);
    double cost = 0;
    Index in_lanes = 0;
    std::vector<LinearPose> poses;
    for (Index i = 0; i < kPoses; ++i) {
      poses.push_back(problem.linear(i));
      const LinearPose& one = poses.back();
      EXPECT_EQ(problem.counts()[static_cast<std::size_t>(i)], one.count()) << of.name << i;
      information += product(one.jacobian.transpose(), one.jacobian);
      gradient += one.jacobian.transpose() * one.conditions;
      cost += one.conditions.squaredNorm();
      in_lanes += problem.as_eliminated(i).elimination.solution.size() == 0;
    }
    EXPECT_GE(in_lanes, 7) << of.name;
    EXPECT_NEAR(equations.cost, cost, 1e-9 * cost) << of.name;
    EXPECT_LT((equations.information - information).norm(), 1e-9 * information.norm()) << of.name;
    EXPECT_LT((equations.gradient - gradient).norm(), 1e-9 * gradient.norm()) << of.name;

    Random random(2);
    Vector step(columns);
    for (double& d : step) {
      d = 1e-4 * random.normal();
    }
    problem.step(step);
    for (Index i = 0; i < kPoses; ++i) {
      const LinearPose& one = poses[static_cast<std::size_t>(i)];
      const Vector errors = -one.variances.cwiseProduct(one.elimination.conditions *
                                                        (one.conditions + one.jacobian * step));
      Vector tangent = one.elimination.solution * -(one.misfit + one.by_unknowns * step + errors);
      Vector moved(tangent.size());
      pose_difference(of.mechanism.pose_space(), problem.poses().row(i).data(),
                      of.poses.row(i).data(), moved.data());
      if (tangent.lpNorm<Eigen::Infinity>() < 0.1) {  // longer ones are cut
        EXPECT_LT((moved - tangent).norm(), 1e-9) << of.name << i;
      }
      for (std::size_t k = 0; k < one.origins.size(); ++k) {
        if (one.origins[k].by_error != 0) {
          EXPECT_NEAR(problem.reading_errors()(i, one.origins[k].index),
                      errors[static_cast<Index>(k)] / one.origins[k].by_error, 1e-9)
              << of.name << i;
        }
      }
    }
  }
}

// What is said of rows takes the conditions as they were eliminated, in any basis.
TEST(LatentRows, LeaveTheSameOfEveryRow) {
  for (const Case& of : cases()) {
    const Observed1 made = observed(of);
    const Layout layout = layout_of(of, made.setup);
    LatentProblem problem(of.mechanism, made.observations, layout, made.setup, of.poses,
                          std::vector<bool>(kPoses, false));
    NormalEquations equations;
    ASSERT_TRUE(problem.linearise(equations)) << of.name;
    for (Index i = 0; i < kPoses; ++i) {
      const LinearPose one = problem.linear(i), lanes = problem.as_eliminated(i);
      const auto spread = [](const LinearPose& pose) {
        return product(pose.elimination.conditions, pose.elimination.conditions.transpose());
      };
      ASSERT_EQ(one.misfit, lanes.misfit) << of.name << i;
      EXPECT_LT((spread(one) - spread(lanes)).norm(), 1e-9 * spread(one).norm()) << of.name << i;
    }
  }
}

}  // namespace
}  // namespace symkin
