// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <utility>

#include "declared/declared_file.hpp"
#include "symkin/chains/declared/pivoted_qr.hpp"
#include "symkin/chains/declared/side_by_side.hpp"
#include "symkin/support/error.hpp"

namespace symkin::declared {
namespace {

using reference::joints_of;
using reference::pose_of;

constexpr double kAccuracy = 1e-12;

Assembly assembly_of(const reference::Leg& leg, const Description& description) {
  return {description, {pose_of(leg.home_pose), joints_of(leg.home_joints)}};
}

// Rows of all closures as the reference has them: pose, readings, errors.
RowMatrix rows_of(const reference::Leg& leg, Assembly& assembly) {
  const Columns wrenches = assembly.reciprocal();
  const std::vector<int> coordinates = leg.coordinates();
  const std::vector<Slot> errors = leg.errors();
  const auto moved = static_cast<Index>(
      std::count_if(errors.begin(), errors.end(), [](Slot slot) { return slot <= Slot::z; }));
  std::vector<std::vector<double>> rows;
  for (Index i = 0; i < wrenches.cols(); ++i) {
    Work work;
    assembly.loops().work(wrenches.col(i), work);
    std::vector<double>& row = rows.emplace_back();
    for (const int coordinate : coordinates) {
      row.push_back(work.pose[coordinate]);
    }
    for (const int read : assembly.read()) {
      row.push_back(work.joints[read]);
    }
    for (std::size_t k = 0; k < leg.transforms.size(); ++k) {
      // The reference moves along the axes behind the transform.
      const Eigen::Matrix3d turn = TransformGeometry(leg.transforms[k]).rotation;
      const Eigen::Map<const Vector> own(&work.scalars[k * errors.size()],
                                         static_cast<Index>(errors.size()));
      const Vector along = turn.topLeftCorner(moved, moved).transpose() * own.head(moved);
      row.insert(row.end(), along.begin(), along.end());
      row.insert(row.end(), own.begin() + moved, own.end());
    }
  }
  RowMatrix all(static_cast<Index>(rows.size()), static_cast<Index>(rows.front().size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    all.row(static_cast<Index>(i)) =
        Eigen::Map<const Vector>(rows[i].data(), all.cols()).transpose();
  }
  return all;
}

class DeclaredLegs : public ::testing::TestWithParam<reference::Leg> {};

TEST(PivotedQr, SolvesWithColumnsThatReachNoMoreThanTheirRank) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto drawn = [&](Index rows, Index cols) {
    Columns all(rows, cols);
    for (Index i = 0; i < cols; ++i) {
      for (Index row = 0; row < rows; ++row) {
        all(row, i) = normal(random);
      }
    }
    return all;
  };
  for (const Index equations : {1, 2, 3, 6, 12, 16}) {
    for (Index rank = 0; rank <= equations; ++rank) {
      // One column more than the rank, a sum of others.
      const Index count = std::min<Index>(rank + 1, kMostJoints);
      const Columns columns = drawn(equations, rank) * drawn(rank, count);
      std::vector<int> chosen;
      for (Index i = count; i-- > 0;) {
        chosen.push_back(static_cast<int>(i));
      }
      const int known = static_cast<int>(rank);
      const PivotedQr qr(columns, chosen, known);
      const Eigen::MatrixXd left = qr.complement();
      ASSERT_EQ(left.cols(), equations - rank);
      const double size = std::max(1.0, columns.norm());
      EXPECT_LT((left.transpose() * Eigen::MatrixXd(columns)).norm(), 1e-13 * size);
      EXPECT_TRUE((left.transpose() * left).isIdentity(1e-13));
      const Equations reached = (columns * drawn(count, 1)).col(0);
      const Joints solution = qr.solve(reached);
      Equations again = Equations::Zero(equations);
      for (int i = 0; i < known; ++i) {
        again += solution[i] * columns.col(qr.column(i));
      }
      EXPECT_LT((again - reached).norm(), 1e-9 * std::max(1.0, reached.norm()));
    }
  }
}

TEST_P(DeclaredLegs, HaveTheRowsOfAnotherProgram) {
  const reference::Leg& leg = GetParam();
  const Description description = leg.description();
  if (leg.closures == 0) {
    EXPECT_THROW(assembly_of(leg, description), InvalidInput);
    return;
  }
  Assembly assembly = assembly_of(leg, description);
  ASSERT_EQ(assembly.closures(), leg.closures);
  for (const reference::Case& each : leg.cases) {
    Joints joints = joints_of(each.joints);
    ASSERT_TRUE(assembly.close_around_readings(pose_of(each.pose), joints));
    EXPECT_LT(assembly.loops().residual().cwiseAbs().maxCoeff(), kAccuracy);
    const RowMatrix rows = rows_of(leg, assembly);
    const Eigen::MatrixXd pivots = rows(kAll, each.pivots);
    const RowMatrix reduced = pivots.partialPivLu().solve(Eigen::MatrixXd(rows));
    for (Index i = 0; i < reduced.rows(); ++i) {
      for (Index k = 0; k < reduced.cols(); ++k) {
        EXPECT_NEAR(reduced(i, k),
                    each.rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)], kAccuracy)
            << "row " << i << ", column " << k;
      }
    }
  }
}

TEST_P(DeclaredLegs, FindTheReadingsOfHomesBranch) {
  const reference::Leg& leg = GetParam();
  if (leg.closures == 0) {
    return;
  }
  const Description description = leg.description();
  Assembly assembly = assembly_of(leg, description);
  for (const reference::Case& each : leg.cases) {
    Joints found;
    ASSERT_TRUE(assembly.close(pose_of(each.pose), found));
    for (const int read : assembly.read()) {
      EXPECT_NEAR(found[read], each.joints[static_cast<std::size_t>(read)], 1e-11);
    }
  }
}

// More poses than lanes, each in a lane of its own and among others; some are reached by steps
// alone, some not at all, and some readings are of other poses.
TEST_P(DeclaredLegs, StandSideBySideAsTheyDoAlone) {
  const reference::Leg& leg = GetParam();
  if (leg.closures == 0) {
    return;
  }
  Description description = leg.description();
  bool first = true;
  for (Joint& joint : description.joints) {  // of several readings the first: each is a leg's own
    joint.read = joint.read && std::exchange(first, first && !joint.read);
  }
  Assembly assembly = assembly_of(leg, description);
  std::vector<LaneTransform> transforms;
  LaneLeg lanes{};
  const SideBySide together(assembly);
  ASSERT_EQ(together.possible(), assembly.lane_leg(transforms, lanes));
  if (!together.possible()) {
    GTEST_SKIP() << "joints may move without its ends";
  }
  const Index closures = assembly.closures();
  std::vector<Pose> poses;
  for (const reference::Case& each : leg.cases) {
    for (const double times : {1.0, 1.5, 3.0, 100.0}) {
      poses.push_back(pose_of(each.pose));
      poses.back().position *= leg.platform == "spherical" ? 1 : times;
    }
  }
  const auto count = static_cast<Index>(poses.size());
  const auto width_of_joints = static_cast<std::size_t>(lanes.own_count);
  std::vector<double> found, by_itself;
  const std::vector<Closed> closed = together.close(poses, found);
  together.close({poses.front()}, by_itself);
  EXPECT_TRUE(std::equal(by_itself.begin(), by_itself.end(), found.begin()));
  Vector read = Vector::Zero(count);
  std::vector<Joints> alone(poses.size());
  for (Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool closes = assembly.close(poses[at], alone[at]);
    ASSERT_TRUE(closed[at] == Closed::perhaps || closes == (closed[at] == Closed::yes)) << i;
    if (closed[at] == Closed::yes) {
      const Eigen::Map<const Vector> here(&found[at * width_of_joints], lanes.own_count);
      EXPECT_LT((here - alone[at]).cwiseAbs().maxCoeff(), kAccuracy);
      read[i] = lanes.read < 0 ? 0 : alone[at][lanes.read] + (i % 3 == 0 ? 1e-3 : 0.3);
    }
  }
  std::vector<double> margins;
  const std::vector<Closed> reached = together.reach_margins(poses, leg.coordinates(), margins);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double margin = assembly.reach_margin(poses[i], leg.coordinates());
    if (reached[i] == Closed::yes) {
      EXPECT_NEAR(1 / margin, 1 / margins[i], 1e-6) << i;  // of differences
    } else {
      ASSERT_NE(closed[i], Closed::yes) << i;
    }
    if (reached[i] == Closed::no) {
      EXPECT_EQ(assembly.missed(poses[i]), margin) << i;
    }
  }
  const Index width = kClosureNumbers + lanes.scalar_count;
  RowMatrix rows(count * closures, width);
  const std::vector<Closed> around =
      together.closures(poses, read, 0, static_cast<int>(closures), rows);
  for (Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (closed[at] != Closed::yes || around[at] != Closed::yes) {
      EXPECT_NE(i % 4, 0) << i;
      continue;
    }
    if (lanes.read >= 0) {
      alone[at][lanes.read] = read[i];
    }
    if (!assembly.close_around_readings(poses[at], alone[at])) {
      EXPECT_NE(i % 3, 0) << i;
      continue;  // both are as near to closing as they come
    }
    const Columns wrenches = assembly.reciprocal();
    Eigen::MatrixXd own(closures, width);
    for (Index k = 0; k < wrenches.cols(); ++k) {
      Work work;
      assembly.loops().work(wrenches.col(k), work);
      own.row(k) << wrenches.col(k).dot(assembly.loops().residual()), work.pose.transpose(),
          lanes.read < 0 ? 0 : work.joints[lanes.read],
          Eigen::Map<const Vector>(work.scalars.data(), lanes.scalar_count).transpose();
    }
    // Of several closures only what they say together has a meaning, and their side.
    const Eigen::MatrixXd mine = rows.middleRows(i * closures, closures);
    const double size = own.squaredNorm();
    EXPECT_LT((mine.transpose() * mine - own.transpose() * own).norm(), kAccuracy * size) << i;
    EXPECT_GT((mine * own.transpose()).determinant(), 0) << i;
    if (closures == 1) {
      EXPECT_GT(mine.row(0).dot(own.row(0)), 0);
    }
  }
}

// Also where loops are not closed, and every number of every transform is large.
TEST_P(DeclaredLegs, HaveColumnsAndWorkThatDifferencesConfirm) {
  const reference::Leg& leg = GetParam();
  Description description = leg.description();
  description.scalars.clear();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-0.3, 0.3);
  for (std::size_t i = 0; i < description.transforms.size(); ++i) {
    for (int slot = 0; slot < kSlots; ++slot) {
      description.transforms[i][static_cast<std::size_t>(slot)] += number(random);
      description.scalars.push_back({"", static_cast<int>(i), static_cast<Slot>(slot), {}, false});
    }
  }
  // The first transform's x stands as another one's z, too, and as every ratio.
  constexpr std::size_t kShared = 1;
  const int last = static_cast<int>(description.transforms.size()) - 1;
  description.scalars.erase(description.scalars.end() - kSlots + static_cast<int>(Slot::z));
  std::vector<Use>& uses = description.scalars[kShared].uses;
  uses.push_back({{Step::Kind::transform, last}, Slot::z, -0.5});
  for (std::size_t i = 0; i < description.joints.size(); ++i) {
    if (description.joints[i].follows != Joint::kOwn) {
      uses.push_back({{Step::Kind::joint, static_cast<int>(i)}, Slot::x, 1.5});
    }
  }
  Vector drawn(static_cast<Index>(description.scalars.size()));
  for (std::size_t i = 0; i < description.scalars.size(); ++i) {
    const Scalar& each = description.scalars[i];
    drawn[static_cast<Index>(i)] = description.transforms[static_cast<std::size_t>(each.transform)]
                                                         [static_cast<std::size_t>(each.slot)];
  }
  Loops loops(description);
  loops.set_scalars(drawn);
  const Pose pose = pose_of(leg.home_pose);
  const Joints joints = joints_of(leg.home_joints);
  loops.walk(pose, joints);
  const Columns columns = loops.columns();
  Equations closure(loops.equations());
  for (double& each : closure) {
    each = number(random);
  }
  Work work;
  loops.work(closure, work);
  EXPECT_LT((columns.transpose() * closure - work.joints).cwiseAbs().maxCoeff(), kAccuracy);
  constexpr double kStep = 1e-6;
  const auto differs = [&](const auto& value_at) {
    return (value_at(kStep) - value_at(-kStep)) / (2 * kStep);
  };
  for (Index i = 0; i < joints.size(); ++i) {
    const double by_joint = differs([&](double step) {
      Joints moved = joints;
      moved[i] += step;
      loops.walk(pose, moved);
      return closure.dot(loops.residual());
    });
    EXPECT_NEAR(by_joint, work.joints[i], 1e-8) << "joint " << i;
  }
  for (std::size_t i = 0; i < description.scalars.size(); ++i) {
    const double by_scalar = differs([&](double step) {
      Vector moved = drawn;
      moved[static_cast<Index>(i)] += step;
      loops.set_scalars(moved);
      loops.walk(pose, joints);
      return closure.dot(loops.residual());
    });
    EXPECT_NEAR(by_scalar, work.scalars[i], 1e-8) << "scalar " << i;
  }
  loops.set_scalars(drawn);
  const int coordinates = leg.platform == "schoenflies" ? 3 : 6;  // another turn is not its own
  for (int i = 0; i < coordinates; ++i) {
    const double by_pose = differs([&](double step) {
      Pose moved = pose;
      if (i < 3) {
        moved.position[i] += step;
      } else {
        moved.rotation = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(i - 3)).toRotationMatrix() *
                         pose.rotation;
      }
      loops.walk(moved, joints);
      return closure.dot(loops.residual());
    });
    EXPECT_NEAR(by_pose, work.pose[i], 1e-8) << "coordinate " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Reference, DeclaredLegs, ::testing::ValuesIn(reference::all_legs()),
                         [](const auto& info) {
                           std::string name;
                           for (const char each : info.param.name) {
                             name += std::isalnum(each) != 0 ? each : '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace symkin::declared
