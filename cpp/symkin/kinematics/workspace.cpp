// SPDX-License-Identifier: MIT
#include "symkin/kinematics/workspace.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "symkin/kinematics/constraint.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr Index kChunk = 1024;
constexpr Index kHopeless = 20000;  // drawn for each pose taken

using Mask = std::vector<char>;  // not bool: bits cost a branch each, which no one foresees

// Poses that are still admitted, with their readings once they are known, their condition numbers
// and where they came from.
struct Block {
  std::vector<Index> origin;
  RowMatrix poses, readings;
  Vector conditions;

  explicit Block(RowMatrix all)
      : origin(static_cast<std::size_t>(all.rows())),
        poses(std::move(all)),
        conditions(poses.rows()) {
    std::iota(origin.begin(), origin.end(), Index{0});
  }

  Index size() const { return poses.rows(); }

  void keep(const Mask& mask) {
    Index kept = std::find(mask.begin(), mask.end(), 0) - mask.begin();
    for (Index row = kept; row < size(); ++row) {  // the next overwrites what is not kept
      origin[static_cast<std::size_t>(kept)] = origin[static_cast<std::size_t>(row)];
      move_row(poses, row, kept);
      move_row(readings, row, kept);
      conditions[kept] = conditions[row];
      kept += mask[static_cast<std::size_t>(row)];
    }
    origin.resize(static_cast<std::size_t>(kept));
    poses.conservativeResize(kept, Eigen::NoChange);
    readings.conservativeResize(kept, Eigen::NoChange);
    conditions.conservativeResize(kept);
  }

 private:
  static void move_row(RowMatrix& rows, Index from, Index to) {
    const Index columns = rows.cols();
    for (Index k = 0; k < columns; ++k) {
      rows.data()[to * columns + k] = rows.data()[from * columns + k];
    }
  }
};

// The demands of WorkspaceOptions, the cheapest first.
class Filter {
 public:
  Filter(const Mechanism& mechanism, const WorkspaceOptions& options)
      : mechanism_(mechanism),
        options_(options),
        scales_(row_scales(mechanism, options.characteristic_length)),
        lower_(limits_of_legs(options.reading_lower, mechanism.leg_count())),
        upper_(limits_of_legs(options.reading_upper, mechanism.leg_count())) {
    const RowMatrix home = on_constraint(mechanism, options.home.transpose());
    const RowMatrix jacobian =
        closed_pose_jacobian(mechanism, home, inverse_kinematics(mechanism, home));
    if (!mechanism.redundant()) {
      home_determinant_ = pose_determinant(jacobian.data(), scales_.size(), mechanism.dof());
    }
  }

  void apply(Block& block, WorkspaceRejections& rejections) const {
    keep_reachable(block, rejections);
    keep_within_limits(block, rejections);
    keep_well_conditioned(block, rejections);
  }

 private:
  void keep_reachable(Block& block, WorkspaceRejections& rejections) const {
    const Index before = block.size();
    const RowMatrix margins = reach_margin(mechanism_, block.poses);
    Mask mask(static_cast<std::size_t>(block.size()));
    for (Index i = 0; i < block.size(); ++i) {
      bool good = true;
      for (Index leg = 0; leg < margins.cols(); ++leg) {
        good &= margins(i, leg) >= options_.reach_margin;
      }
      for (Index k = 0; k < block.poses.cols(); ++k) {
        good &= std::isfinite(block.poses(i, k));
      }
      mask[static_cast<std::size_t>(i)] = good;
    }
    block.keep(mask);
    rejections.reach += before - block.size();
  }

  void keep_within_limits(Block& block, WorkspaceRejections& rejections) const {
    const Index before = block.size();
    block.readings = inverse_kinematics(mechanism_, block.poses);
    Mask mask(static_cast<std::size_t>(block.size()));
    for (Index i = 0; i < block.size(); ++i) {
      const auto readings = block.readings.row(i).array();
      mask[static_cast<std::size_t>(i)] =
          (readings >= lower_.array()).all() && (readings <= upper_.array()).all();
    }
    block.keep(mask);
    rejections.limits += before - block.size();
  }

  void keep_well_conditioned(Block& block, WorkspaceRejections& rejections) const {
    const Index dof = mechanism_.dof();
    const RowMatrix jacobian = closed_pose_jacobian(mechanism_, block.poses, block.readings);
    block.conditions =
        pose_conditions(jacobian, scales_, mechanism_.pose_space(), options_.characteristic_length);
    Mask mask(static_cast<std::size_t>(block.size()));
    for (Index i = 0; i < block.size(); ++i) {
      const bool same =
          home_determinant_ == 0 ||
          pose_determinant(jacobian.row(i).data(), scales_.size(), dof) * home_determinant_ > 0;
      const bool good = same && block.conditions[i] <= options_.conditioning_limit;
      rejections.aspect += same ? 0 : 1;
      rejections.conditioning += same && !good ? 1 : 0;
      mask[static_cast<std::size_t>(i)] = good;
    }
    block.keep(mask);
  }

  const Mechanism& mechanism_;
  const WorkspaceOptions& options_;
  Vector scales_;
  Eigen::RowVectorXd lower_, upper_;  // of the readings
  double home_determinant_ = 0;       // 0: any aspect
};

RowMatrix draw_block(const WorkspaceOptions& options, const Mechanism& mechanism,
                     std::uint64_t seed, std::uint64_t stream) {
  const PoseSpace space = mechanism.pose_space();
  Random random(seed, stream);
  const Vector origin = identity_pose(space);
  RowMatrix steps(kChunk, options.lower.size());
  for (Index i = 0; i < kChunk; ++i) {
    for (Index k = 0; k < steps.cols(); ++k) {
      steps(i, k) = options.lower[k] + random.uniform() * (options.upper[k] - options.lower[k]);
    }
  }
  if (!has_quaternion(space)) {
    return steps;  // from the origin, and nothing binds such poses
  }
  RowMatrix poses = origin.transpose().replicate(kChunk, 1);
  for (Index i = 0; i < kChunk; ++i) {
    move_pose(space, steps.row(i).data(), poses.row(i).data());
  }
  return on_constraint(mechanism, poses);
}

void check_count(Index count) {
  if (count < 1) {
    throw InvalidInput("asked for " + std::to_string(count) + " poses; expected at least 1");
  }
}

std::string most_frequent(const WorkspaceRejections& rejections) {
  const std::pair<Index, const char*> reasons[] = {
      {rejections.reach, "out of reach (with reach_margin)"},
      {rejections.limits, "beyond the joint limits"},
      {rejections.aspect, "in another aspect than home"},
      {rejections.conditioning, "conditioned worse than conditioning_limit"}};
  return std::max_element(std::begin(reasons), std::end(reasons))->second;
}

void check_home(const Mechanism& mechanism, const WorkspaceOptions& options, const Filter& filter) {
  WorkspaceRejections rejections;
  Block block(on_constraint(mechanism, options.home.transpose()));
  filter.apply(block, rejections);
  if (block.size() == 0) {
    throw InvalidInput("the home pose of mechanism \"" + mechanism.name() + "\" is " +
                       most_frequent(rejections));
  }
}

}  // namespace

Vector limits_of_legs(const Vector& limits, Index legs) {
  return limits.size() == 1 ? Vector::Constant(legs, limits[0]) : limits;
}

void WorkspaceOptions::check(const Mechanism& mechanism) const {
  const auto dof = mechanism.dof();
  if (home.size() != coordinate_count(mechanism.pose_space())) {
    throw InvalidInput("home has " + std::to_string(home.size()) + " coordinates; a " +
                       std::string(to_string(mechanism.pose_space())) + " pose has " +
                       std::to_string(coordinate_count(mechanism.pose_space())));
  }
  if (lower.size() != dof || upper.size() != dof) {
    throw InvalidInput("the workspace box has " + std::to_string(lower.size()) + " and " +
                       std::to_string(upper.size()) + " bounds; expected " + std::to_string(dof));
  }
  for (Index i = 0; i < dof; ++i) {
    if (!(lower[i] <= upper[i]) || !std::isfinite(upper[i] - lower[i])) {
      throw InvalidInput("workspace bound " + std::to_string(i + 1) + " runs from " +
                         std::to_string(lower[i]) + " to " + std::to_string(upper[i]) +
                         "; expected a finite interval");
    }
  }
  for (const Vector& limits : {reading_lower, reading_upper}) {
    if (limits.size() != 1 && limits.size() != mechanism.leg_count()) {
      throw InvalidInput("there are " + std::to_string(limits.size()) +
                         " limits of the readings; expected one, or one a leg, " +
                         std::to_string(mechanism.leg_count()));
    }
  }
  if (!(reach_margin >= 0) || !(conditioning_limit >= 1) || !(characteristic_length > 0)) {
    throw InvalidInput(
        "expected reach_margin >= 0, conditioning_limit >= 1 and characteristic_length > 0; got " +
        std::to_string(reach_margin) + ", " + std::to_string(conditioning_limit) + " and " +
        std::to_string(characteristic_length));
  }
}

WorkspaceSample sample_workspace(const Mechanism& mechanism, const WorkspaceOptions& options,
                                 Index count, std::uint64_t seed) {
  options.check(mechanism);
  check_count(count);
  const Filter filter(mechanism, options);
  check_home(mechanism, options, filter);
  WorkspaceSample sample;
  sample.poses.resize(count, coordinate_count(mechanism.pose_space()));
  sample.readings.resize(count, mechanism.leg_count());
  sample.conditions.resize(count);
  Index taken = 0;
  for (std::uint64_t stream = 0; taken < count; ++stream) {
    check_interrupt();
    Block block(draw_block(options, mechanism, seed, stream));
    filter.apply(block, sample.rejections);
    const Index room = std::min(block.size(), count - taken);
    sample.poses.middleRows(taken, room) = block.poses.topRows(room);
    sample.readings.middleRows(taken, room) = block.readings.topRows(room);
    sample.conditions.segment(taken, room) = block.conditions.head(room);
    taken += room;
    sample.drawn += kChunk;
    if (sample.drawn > kHopeless * (taken + 1)) {
      throw InvalidInput("only " + std::to_string(taken) + " of " + std::to_string(sample.drawn) +
                         " poses drawn from the workspace box of mechanism \"" + mechanism.name() +
                         "\" can be used; most are " + most_frequent(sample.rejections));
    }
  }
  return sample;
}

RowMatrix draw_poses(const Mechanism& mechanism, const WorkspaceOptions& options, Index count,
                     std::uint64_t seed) {
  options.check(mechanism);
  check_count(count);
  RowMatrix poses(count, coordinate_count(mechanism.pose_space()));
  for (Index first = 0; first < count; first += kChunk) {
    check_interrupt();
    const Index size = std::min(kChunk, count - first);
    poses.middleRows(first, size) =
        draw_block(options, mechanism, seed, static_cast<std::uint64_t>(first / kChunk))
            .topRows(size);
  }
  return poses;
}

std::vector<bool> inside_workspace(const Mechanism& mechanism, const WorkspaceOptions& options,
                                   ConstRows poses) {
  options.check(mechanism);
  check_poses(mechanism, poses);
  Block block(poses);
  WorkspaceRejections rejections;
  Filter(mechanism, options).apply(block, rejections);
  std::vector<bool> inside(static_cast<std::size_t>(poses.rows()), false);
  for (const Index i : block.origin) {
    inside[static_cast<std::size_t>(i)] = true;
  }
  return inside;
}

}  // namespace symkin
