// SPDX-License-Identifier: MIT
// The models take several poses side by side, in the width of the processor. They must say what
// the same kernels say on plain doubles, one pose at a time.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chains/every_chain.hpp"
#include "symkin/chains/detail/kernels.hpp"
#include "symkin/chains/ppr.hpp"
#include "symkin/chains/prp.hpp"
#include "symkin/chains/prr.hpp"
#include "symkin/chains/prs.hpp"
#include "symkin/chains/pulley.hpp"
#include "symkin/chains/pus.hpp"
#include "symkin/chains/rpp.hpp"
#include "symkin/chains/rpr.hpp"
#include "symkin/chains/rps.hpp"
#include "symkin/chains/rrp.hpp"
#include "symkin/chains/rrr.hpp"
#include "symkin/chains/rus.hpp"
#include "symkin/chains/spherical.hpp"
#include "symkin/chains/ups.hpp"

namespace symkin::testing {
namespace {

class PlainModel final : public KernelModel {
 public:
  PlainModel(ChainInfo info, const LegKernels& kernels) : KernelModel(std::move(info), kernels) {}

  void reading_differences(ConstVector, ConstVector, ConstVector,
                           Eigen::Ref<Vector>) const override {}
  double sensor_gain(ConstVector, double) const override { return 0; }
  RowMatrix joint_centres(ConstVector, ConstVector, double) const override { return {}; }
};

using Models = std::map<std::pair<std::string, Platform>, PlainModel>;

template <typename... Legs>
void add(Models& models, ChainList<Legs...> /*chains*/) {
  const auto platform = [](PoseSpace space) {
    return space == PoseSpace::point         ? Platform::point
           : space == PoseSpace::translating ? Platform::translating
           : space == PoseSpace::spherical   ? Platform::spherical
                                             : Platform::rigid;
  };
  (models.emplace(
       std::pair(std::string(Legs::kName), platform(Legs::template Pose<double>::kSpace)),
       PlainModel(SensedLeg<Legs>::info(), leg_kernels<Legs, LinearSensor, double>())),
   ...);
}

template <typename Chains>
void add_family(Models& models) {
  add(models, decltype(chains::with_points(Chains()))());
}

const Models& plain_models() {
  static const Models models = [] {
    Models all;
    add_family<RrrChains>(all);
    add_family<RprChains>(all);
    add_family<PrrChains>(all);
    add_family<RrpChains>(all);
    add_family<PrpChains>(all);
    add_family<PprChains>(all);
    add_family<RppChains>(all);
    add_family<UpsChains>(all);
    add_family<PulleyChains>(all);
    add_family<PusChains>(all);
    add_family<RusChains>(all);
    add_family<RpsChains>(all);
    add_family<PrsChains>(all);
    add_family<SphericalChains>(all);
    return all;
  }();
  return models;
}

bool same_bits(const RowMatrix& a, const RowMatrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(),
                                       sizeof(double) * static_cast<std::size_t>(a.size())) == 0);
}

class Batches : public EveryChain {
 protected:
  static constexpr Index kLegs = 3;

  const ChainModel& plain() const {
    return plain_models().at({GetParam().name, GetParam().platform});
  }
  Index dof() const { return degrees_of_freedom(info().pose_space); }
  Index coordinates() const { return coordinate_count(info().pose_space); }

  // Legs in both modes.
  void draw_legs(Random& random, Index count) {
    parameters_.clear();
    legs_.clear();
    for (Index i = 0; i < count; ++i) {
      parameters_.push_back(random_parameters(random));
    }
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      legs_.push_back({parameters_[i].data(), i % 2 == 0 ? 1 : -1});
    }
  }

  // Within reach and beyond, one that is not a number, one far away.
  RowMatrix draw_poses(Random& random, Index count) const {
    RowMatrix poses(count, coordinates());
    for (Index i = 0; i < count; ++i) {
      poses.row(i) = random_pose(random, 2);
    }
    if (count > 2) {
      poses(count / 2, 0) = std::nan("");
      poses(count - 1, 1) = 1e3;
    }
    return poses;
  }

  // As good a root of the closure: where a leg is nearly stretched rounding moves q by more.
  void expect_same_readings(const RowMatrix& poses, const RowMatrix& readings,
                            const RowMatrix& expected) const {
    const RowMatrix margins = plain().reach_margin(legs_, poses);
    const PoseDerivatives slopes = plain().linearise_pose(legs_, poses, expected);
    for (Index i = 0; i < poses.rows(); ++i) {
      for (Index leg = 0; leg < expected.cols(); ++leg) {
        if (std::abs(margins(i, leg)) < 1e-12) {
          continue;  // rounding decides whether it is reached
        }
        ASSERT_EQ(std::isnan(readings(i, leg)), std::isnan(expected(i, leg)));
        if (!std::isnan(expected(i, leg))) {
          const double error = std::abs(readings(i, leg) - expected(i, leg));
          EXPECT_LT(error * std::min(1.0, std::abs(slopes.by_reading(i, leg))),
                    1e-12 * (1 + std::abs(expected(i, leg))));
        }
      }
    }
  }

  static void expect_close(const RowMatrix& values, const RowMatrix& expected,
                           double tolerance = 1e-12) {
    ASSERT_EQ(values.rows(), expected.rows());
    ASSERT_EQ(values.cols(), expected.cols());
    for (Index i = 0; i < values.size(); ++i) {
      const double a = values.data()[i];
      const double b = expected.data()[i];
      ASSERT_EQ(std::isnan(a), std::isnan(b));
      if (std::isfinite(b)) {
        EXPECT_LT(std::abs(a - b), tolerance * (1 + std::abs(b)));
      } else if (!std::isnan(b)) {
        EXPECT_EQ(a, b);
      }
    }
  }

  std::vector<Vector> parameters_;
  ChainModel::Legs legs_;
};

TEST_P(Batches, SayWhatPlainDoublesSay) {
  Random random(5);
  for (const Index count : {0, 1, 2, 3, 4, 5, 7, 8, 200}) {
    draw_legs(random, kLegs);
    const RowMatrix poses = draw_poses(random, count);
    const RowMatrix expected = plain().inverse_kinematics(legs_, poses);
    expect_same_readings(poses, model().inverse_kinematics(legs_, poses), expected);
    expect_close(model().reach_margin(legs_, poses), plain().reach_margin(legs_, poses));

    RowMatrix readings = expected;
    for (Index i = 0; i < readings.size(); ++i) {
      readings.data()[i] += random.normal();  // closures stay finite wherever a pose is
    }
    const PoseDerivatives ours = model().linearise_pose(legs_, poses, readings);
    const PoseDerivatives theirs = plain().linearise_pose(legs_, poses, readings);
    expect_close(ours.closure, theirs.closure);
    expect_close(ours.by_pose, theirs.by_pose);
    expect_close(ours.by_reading, theirs.by_reading);

    const Vector of_leg = readings.col(1);
    ClosureRows rows, plain_rows;
    model().linearise(parameters_[1], poses, of_leg, rows);
    plain().linearise(parameters_[1], poses, of_leg, plain_rows);
    expect_close(rows.closure, plain_rows.closure);
    expect_close(rows.by_parameters, plain_rows.by_parameters);
    expect_close(rows.by_pose, plain_rows.by_pose);
    expect_close(rows.by_reading, plain_rows.by_reading);
    Vector closures(count * info().closures), plain_closures(count * info().closures);
    model().closure(parameters_[1], poses, of_leg, closures);
    plain().closure(parameters_[1], poses, of_leg, plain_closures);
    expect_close(closures, plain_closures);
  }
}

// As many as the processor has lanes, and other numbers of them.
TEST_P(Batches, SayOfLegsSideBySideWhatTheySayOfEachAlone) {
  Random random(9);
  constexpr Index kPoses = 3;
  const Index p = static_cast<Index>(info().parameters.size());
  const Index width = p + dof() + 2;
  for (const Index lanes : {1, 2, 3, 4}) {
    draw_legs(random, lanes);
    RowMatrix parameters(p, lanes), poses(kPoses * coordinates(), lanes), readings(kPoses, lanes);
    RowMatrix all(kPoses * info().closures * width, lanes), expected = all;
    for (Index lane = 0; lane < lanes; ++lane) {
      const RowMatrix own = draw_poses(random, kPoses);
      const Vector shown = Vector::NullaryExpr(kPoses, [&] { return random.normal(); });
      const Vector& leg = parameters_[static_cast<std::size_t>(lane)];
      parameters.col(lane) = leg;
      poses.col(lane) = Eigen::Map<const Vector>(own.data(), own.size());
      readings.col(lane) = shown;
      ClosureRows rows;
      plain().linearise(leg, own, shown, rows);
      for (Index i = 0; i < rows.closure.size(); ++i) {
        expected.col(lane).segment(i * width, width) << rows.closure[i],
            rows.by_parameters.row(i).transpose(), rows.by_pose.row(i).transpose(),
            rows.by_reading[i];
      }
    }
    model().linearise_lanes({lanes, kPoses, parameters.data(), poses.data(), readings.data()},
                            all.data());
    expect_close(all, expected);
  }
}

TEST_P(Batches, GiveAPoseTheSameBitsWhateverStandsBesideIt) {
  Random random(6);
  for (const Index count : {2, 5, 11}) {
    draw_legs(random, kLegs);
    const RowMatrix poses = draw_poses(random, count);
    const RowMatrix readings = model().inverse_kinematics(legs_, poses);
    const RowMatrix margins = model().reach_margin(legs_, poses);
    const PoseDerivatives slopes = model().linearise_pose(legs_, poses, readings);
    for (Index i = 0; i < count; ++i) {
      const RowMatrix pose = poses.row(i);
      EXPECT_TRUE(same_bits(model().inverse_kinematics(legs_, pose), readings.row(i)));
      EXPECT_TRUE(same_bits(model().reach_margin(legs_, pose), margins.row(i)));
      const PoseDerivatives alone = model().linearise_pose(legs_, pose, readings.row(i));
      EXPECT_TRUE(same_bits(alone.by_pose, slopes.by_pose.row(i)));
    }
  }
}

TEST_P(Batches, ReadAStretchedAndAFoldedLegAsPlainDoublesDo) {
  if (!has_two_roots(GetParam())) {
    GTEST_SKIP() << "reaches everywhere";
  }
  Random random(7);
  draw_legs(random, 1);
  RowMatrix poses(50, coordinates());
  for (Index i = 0; i < poses.rows(); ++i) {
    // Towards the end of the reach by its own margin, until rounding stops it.
    State state{parameters_[0], random_pose(random, 2), 1, 0};
    for (int step = 0; step < 40 && std::abs(margin(state)) > 1e-9; ++step) {
      const double now = margin(state);
      State best = state;
      for (int k = 0; k < 64; ++k) {
        const State moved = translated(state, std::abs(now), 2 * M_PI * k / 64);
        best = std::abs(margin(moved)) < std::abs(margin(best)) ? moved : best;
      }
      state = best;
    }
    poses.row(i) = state.pose;
  }
  expect_same_readings(poses, model().inverse_kinematics(legs_, poses),
                       plain().inverse_kinematics(legs_, poses));
}

// As many legs as degrees of freedom, and one more (least squares).
TEST_P(Batches, SolveTheForwardKinematicsAsPlainDoublesDo) {
  Random random(8);
  Index converged = 0;
  Index others = 0;
  const Index closures = info().closures;
  for (const Index extra : {0, 1}) {
    if (extra > 0 && closures > 1) {
      continue;  // would hold the platform fast
    }
    for (int mechanism = 0; mechanism < (closures > 1 ? 200 : 20); ++mechanism) {
      draw_legs(random, dof() / closures + extra);
      RowMatrix poses = draw_poses(random, 41);
      if (info().pose_space == PoseSpace::spatial) {
        poses.rightCols(4).rowwise().normalize();
      }
      RowMatrix readings = plain().inverse_kinematics(legs_, poses);
      if (closures > 1) {  // where the legs allow a pose
        const RowMatrix anywhere = poses;
        std::vector<ForwardStatus> status;
        plain().forward_kinematics(legs_, readings, anywhere, {}, poses, status);
        readings = plain().inverse_kinematics(legs_, poses);
      }
      readings(3, 0) += 0.3;  // another pose, or none
      readings(4, 0) += 100;
      RowMatrix start = poses;
      start.leftCols(2).array() += 0.01;
      const auto solve = [&](const ChainModel& model, RowMatrix& found) {
        std::vector<ForwardStatus> status;
        model.forward_kinematics(legs_, readings, start, {}, found, status);
        return status;
      };
      RowMatrix ours, theirs;
      const auto status = solve(model(), ours);
      const auto expected = solve(plain(), theirs);
      // Least singular value of dh/dpose: of the start, and of what was found.
      const auto regularity = [&](const RowMatrix& at, Index row) {
        const RowMatrix jacobian =
            plain().linearise_pose(legs_, at.row(row), readings.row(row)).by_pose;
        const Eigen::Map<const RowMatrix> rows(jacobian.data(), legs_.size() * closures, dof());
        return rows.allFinite()
                   ? Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues()[dof() - 1]
                   : 1.0;
      };
      for (Index i = 0; i < poses.rows(); ++i) {
        const double found = regularity(theirs, i);
        if (regularity(start, i) < 0.05 || found < 1e-3) {
          continue;  // near a singularity rounding decides
        }
        const auto row = static_cast<std::size_t>(i);
        EXPECT_EQ(status[row], expected[row]) << "mechanism " << mechanism << ", row " << i;
        expect_close(ours.row(i), theirs.row(i), 1e-12 / std::min(1.0, found));
        converged += status[row] == ForwardStatus::converged ? 1 : 0;
        others += status[row] != ForwardStatus::converged ? 1 : 0;
      }
    }
  }
  EXPECT_GT(converged, 100);
  EXPECT_GT(others, 20);
}

INSTANTIATE_TEST_SUITE_P(Chains, Batches, ::testing::ValuesIn(registered_chains()), test_name);

}  // namespace
}  // namespace symkin::testing
