// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/pair_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "symkin/estimation/detail/factors.hpp"

namespace symkin {
namespace {

class BetweenPoses {
  // Directions: the poses' six each, the base's six where each of them is, the target's six, and
  // the slopes and the bow of the bed.
  static constexpr int kPoses = 0, kBases = 12, kTarget = 24, kPlane = 30, kDirections = 33;
  using Value = Jet<double, kDirections>;
  using Place = factors::Vec3<Value>;

 public:
  BetweenPoses(const Mechanism& mechanism, const Observations& observations, const Layout& layout,
               const Setup& setup, const RowMatrix& poses)
      : mechanism_(mechanism),
        observations_(observations),
        layout_(layout),
        setup_(setup),
        poses_(poses),
        list_(setup),
        moves_(observations.base_covariates.cols() > 0) {}

  // Rows of what was measured between a pose and its k-th partner.
  void add(Index pose, Index k, const std::vector<Index>& hubs, LinearPiece& to) {
    using factors::operator-;
    ends_[0] = static_cast<Index>(observations_.partners(pose, k));
    ends_[1] = pose;
    for (int end = 0; end < 2; ++end) {
      own_[at(end)] = std::binary_search(to.poses.begin(), to.poses.end(), ends_[at(end)]);
      const std::vector<Index>& of = own_[at(end)] ? to.poses : hubs;
      places_[at(end)] = std::lower_bound(of.begin(), of.end(), ends_[at(end)]) - of.begin();
      stand(end);
    }
    const auto measured = [&](const Observed& observed, Index column) {
      return observed.any() && std::isfinite(observed.values(pose, column));
    };
    if (measured(observations_.separations, k)) {
      // Where the base stays where it is, its place and its turn are exactly nothing to it.
      const Place way = moves_ ? seen_[1] - seen_[0] : targets_[1] - targets_[0];
      add_row(RowOrigin::Kind::separation, observations_.separations, k,
              sqrt(factors::dot(way, way)), to);
    }
    if (measured(observations_.rises, k)) {
      const Place way = targets_[1] - targets_[0];
      const Value along(setup_.plane[1], kPlane), across(setup_.plane[2], kPlane + 1);
      const Value bend =
          Value(setup_.plane[3], kPlane + 2) / (setup_.bed_radius * setup_.bed_radius);
      const Value bed = along * way[0] + across * way[1] + bend * (squared(1) - squared(0));
      add_row(RowOrigin::Kind::rise, observations_.rises, k,
              (way[2] - bed) / sqrt(1.0 + along * along + across * across), to);
    }
    const Index dimensions = position_size(mechanism_.pose_space());
    for (Index axis = 0; axis < dimensions; ++axis) {
      const Index column = k * dimensions + axis;
      if (measured(observations_.offsets, column)) {
        add_row(RowOrigin::Kind::offset, observations_.offsets, column,
                seen_[1][at(axis)] - seen_[0][at(axis)], to);
      }
    }
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  // The square of the way of one end from the middle of the bed.
  Value squared(int end) const {
    const Place& target = targets_[at(end)];
    return target[0] * target[0] + target[1] * target[1];
  }

  // The target of one end, in the base's frame and as the device sees it.
  void stand(int end) {
    using factors::operator*;
    using factors::operator+;
    const Index pose = ends_[at(end)];
    double frame[12], base[12], target[12];
    write_frame(frame_of_pose(mechanism_.pose_space(), poses_.row(pose).data()), frame);
    write_frame(moves_ ? setup_.base_at(observations_.base_covariates.row(pose)) : setup_.base,
                base);
    write_frame(setup_.target, target);
    const int own = kPoses + 6 * end, of_base = kBases + 6 * end;
    targets_[at(end)] = factors::variable_position<Value>(frame, own) +
                        factors::variable_rotation<Value>(frame + 3, own + 3) *
                            factors::variable_position<Value>(target, kTarget);
    seen_[at(end)] = factors::variable_position<Value>(base, of_base) +
                     factors::variable_rotation<Value>(base + 3, of_base + 3) * targets_[at(end)];
  }

  void add_row(RowOrigin::Kind kind, const Observed& observed, Index column, const Value& value,
               LinearPiece& piece) {
    LinearPose& to = piece.rows;
    const Index row = static_cast<Index>(to.origins.size());
    to.origins.push_back({kind, column, 0, ends_[1]});
    to.misfit[row] = value.a - observed.values(ends_[1], column);
    to.variances[row] =
        observed.deviations(ends_[1], column) * observed.deviations(ends_[1], column);
    const auto& slots = pose_slots(mechanism_.pose_space());
    const auto dof = static_cast<Index>(slots.size());
    for (int end = 0; end < 2; ++end) {
      RowMatrix& by_end = own_[at(end)] ? to.by_pose : piece.by_hubs;
      for (Index i = 0; i < dof; ++i) {
        by_end(row, places_[at(end)] * dof + i) = value.v[kPoses + 6 * end + slots[at(i)]];
      }
      add_base(end, value, to.by_unknowns.row(row));
    }
    for (int i = 0; i < 6; ++i) {
      add_scalar(list_.target() + i, value.v[kTarget + i], to.by_unknowns.row(row));
    }
    for (int i = 0; i < 3; ++i) {
      add_scalar(list_.plane() + 1 + i, value.v[kPlane + i], to.by_unknowns.row(row));
    }
  }

  using Row = RowMatrix::RowXpr;

  // Where the base stands at exp([w]) R_B, what turns R_B comes through exp([w]), and what changes
  // w through its left Jacobian.
  void add_base(int end, const Value& value, Row row) {
    const Eigen::Matrix<double, 6, 1> by_place(value.v.segment<6>(kBases + 6 * end));
    if (!moves_) {
      for (int i = 0; i < 6; ++i) {
        add_scalar(list_.base() + i, by_place[i], row);
      }
      return;
    }
    const auto covariates = observations_.base_covariates.row(ends_[at(end)]);
    const Eigen::Vector3d turn = (covariates * setup_.base_slopes).tail<3>().transpose();
    Eigen::Matrix<double, 6, 1> by_base = by_place, by_slope = by_place;
    by_base.tail<3>() = rotation_of(turn).transpose() * by_place.tail<3>();
    by_slope.tail<3>() = left_jacobian(turn).transpose() * by_place.tail<3>();
    for (Index i = 0; i < 6; ++i) {
      add_scalar(list_.base() + i, by_base[i], row);
      for (Index k = 0; k < covariates.size(); ++k) {
        add_scalar(list_.base_slope(k) + i, covariates[k] * by_slope[i], row);
      }
    }
  }

  void add_scalar(Index scalar, double derivative, Row row) const {
    if (layout_.column[at(scalar)] >= 0) {
      row[layout_.column[at(scalar)]] += derivative;
    }
    for (const Tie& tie : layout_.ties) {
      if (tie.scalar == scalar) {
        row[tie.column] += tie.factor * derivative;
      }
    }
  }

  const Mechanism& mechanism_;
  const Observations& observations_;
  const Layout& layout_;
  const Setup& setup_;
  const RowMatrix& poses_;
  UnknownList list_;
  bool moves_;
  std::array<Index, 2> ends_{}, places_{};
  std::array<bool, 2> own_{};  // whether an end is of the piece itself, and no hub
  std::array<Place, 2> targets_{}, seen_{};
};

// The rows of a piece, those between poses last.
LinearPiece piece_rows(const Mechanism& mechanism, const Layout& layout,
                       const PoseBlocks::Piece& piece, const std::vector<Index>& hubs,
                       const LatentPoses& rows, BetweenPoses& between) {
  const Index dof = mechanism.dof();
  const auto size = static_cast<Index>(piece.poses.size());
  std::vector<LinearPose> own;
  Index count = 0;
  for (const Index pose : piece.poses) {
    own.push_back(rows.rows(pose));
    count += own.back().misfit.size();
  }
  const auto most =
      static_cast<Index>(piece.pairs.size()) * (2 + position_size(mechanism.pose_space()));
  LinearPiece of{piece.poses, {}, {}};
  LinearPose& all = of.rows;
  all.misfit.setZero(count + most);
  all.variances.setZero(count + most);
  all.by_pose.setZero(count + most, size * dof);
  all.by_unknowns.setZero(count + most, layout.columns());
  of.by_hubs.setZero(count + most, static_cast<Index>(hubs.size()) * dof);
  for (Index i = 0; i < size; ++i) {
    const LinearPose& one = own[static_cast<std::size_t>(i)];
    const auto first = static_cast<Index>(all.origins.size());
    const Index m = one.misfit.size();
    all.misfit.segment(first, m) = one.misfit;
    all.variances.segment(first, m) = one.variances;
    all.by_pose.block(first, i * dof, m, dof) = one.by_pose;
    all.by_unknowns.middleRows(first, m) = one.by_unknowns;
    all.origins.insert(all.origins.end(), one.origins.begin(), one.origins.end());
  }
  for (const auto& [pose, k] : piece.pairs) {
    between.add(pose, k, hubs, of);
  }
  const auto taken = static_cast<Index>(all.origins.size());
  all.misfit.conservativeResize(taken);
  all.variances.conservativeResize(taken);
  all.by_pose.conservativeResize(taken, Eigen::NoChange);
  all.by_unknowns.conservativeResize(taken, Eigen::NoChange);
  of.by_hubs.conservativeResize(taken, Eigen::NoChange);
  return of;
}

// Sets of poses that join each other.
class Sets {
 public:
  explicit Sets(std::size_t count) : root_(count) {
    std::iota(root_.begin(), root_.end(), Index{0});
  }
  Index first(Index pose) {
    while (root_[at(pose)] != pose) {
      pose = root_[at(pose)] = root_[at(root_[at(pose)])];
    }
    return pose;
  }
  void join(Index one, Index other) {
    const Index roots[] = {first(one), first(other)};
    root_[at(std::max(roots[0], roots[1]))] = std::min(roots[0], roots[1]);
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  std::vector<Index> root_;
};

}  // namespace

PoseBlocks::PoseBlocks(const Observations& observations, const std::vector<bool>& aside) {
  constexpr Index kMany = 5;  // pairs of a hub
  const RowMatrix& partners = observations.partners;
  if (partners.cols() == 0) {
    return;
  }
  const auto count = static_cast<Index>(aside.size());
  std::vector<Pair> pairs;
  std::vector<Index> of_pose(aside.size(), 0);  // pairs that it is in
  Sets together(aside.size()), apart(aside.size());
  const auto other = [&](const Pair& pair) {
    return static_cast<Index>(partners(pair.first, pair.second));
  };
  for (Index pose = 0; pose < count; ++pose) {
    for (Index k = 0; k < partners.cols(); ++k) {
      const Pair pair{pose, k};
      if (observations.couples(pose, k) && !aside[at(pose)] && !aside[at(other(pair))]) {
        pairs.push_back(pair);
        ++of_pose[at(pose)];
        ++of_pose[at(other(pair))];
        together.join(pose, other(pair));
      }
    }
  }
  const auto is_hub = [&](Index pose) { return of_pose[at(pose)] >= kMany; };
  for (const Pair& pair : pairs) {
    if (!is_hub(pair.first) && !is_hub(other(pair))) {
      apart.join(pair.first, other(pair));
    }
  }
  std::vector<Index> parts(aside.size(), 0);  // of each first of a block, besides hubs
  first_.resize(aside.size());
  for (Index pose = 0; pose < count; ++pose) {
    first_[at(pose)] = together.first(pose);
    parts[at(first(pose))] += !is_hub(pose) && apart.first(pose) == pose ? 1 : 0;
  }
  const auto held = [&](Index pose) { return is_hub(pose) && parts[at(first(pose))] > 1; };
  const auto piece_first = [&](Index pose) {
    return parts[at(first(pose))] > 1 ? apart.first(pose) : first(pose);
  };
  block_.assign(aside.size(), -1);
  std::vector<Index> place(aside.size(), -1);  // of each first of a piece, among those of its block
  const auto piece_of = [&](Index pose) -> Piece& {
    Block& block = blocks_[at(block_[at(first(pose))])];
    return held(pose) ? block.hubs : block.pieces[at(place[at(piece_first(pose))])];
  };
  for (Index pose = 0; pose < count; ++pose) {
    if (of_pose[at(pose)] == 0) {
      continue;
    }
    Index& block = block_[at(first(pose))];
    if (block < 0) {
      block = static_cast<Index>(blocks_.size());
      blocks_.emplace_back();
    }
    if (!held(pose) && place[at(piece_first(pose))] < 0) {
      std::vector<Piece>& pieces = blocks_[at(block)].pieces;
      place[at(piece_first(pose))] = static_cast<Index>(pieces.size());
      pieces.emplace_back();
    }
    piece_of(pose).poses.push_back(pose);
  }
  for (const Pair& pair : pairs) {
    piece_of(held(pair.first) ? other(pair) : pair.first).pairs.push_back(pair);
  }
}

LinearBlock block_rows(const Mechanism& mechanism, const Observations& observations,
                       const Layout& layout, const Setup& setup, const RowMatrix& poses,
                       const LatentPoses& rows, const PoseBlocks::Block& block) {
  BetweenPoses between(mechanism, observations, layout, setup, poses);
  const auto piece = [&](const PoseBlocks::Piece& of, const std::vector<Index>& hubs) {
    return piece_rows(mechanism, layout, of, hubs, rows, between);
  };
  std::vector<LinearPiece> pieces;
  for (const PoseBlocks::Piece& of : block.pieces) {
    pieces.push_back(piece(of, block.hubs.poses));
  }
  return {std::move(pieces), piece(block.hubs, {})};
}

}  // namespace symkin
