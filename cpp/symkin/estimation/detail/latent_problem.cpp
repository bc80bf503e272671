// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/latent_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// Rows beside the poses, A d + off = 0. Returns their squares.
double add_rows(const RowMatrix& rows, const Vector& off, NormalEquations& equations) {
  equations.information += product(rows.transpose(), rows);
  equations.gradient.noalias() += rows.transpose() * off;
  equations.cost += off.squaredNorm();
  return off.squaredNorm();
}

}  // namespace

LatentProblem::LatentProblem(const Mechanism& mechanism, const Observations& observations,
                             const Layout& layout, Setup setup, RowMatrix poses,
                             std::vector<bool> aside)
    : mechanism_(mechanism),
      observations_(observations),
      layout_(layout),
      aside_(std::move(aside)),
      blocks_(observations, aside_),
      constraints_(0, layout.columns()),
      turns_(turns_of(mechanism.pose_space(), setup, layout_)),
      now_{LatentPoses(mechanism, observations, layout_, setup), {}, {}, {}, {}, {}, {}, 0, {}},
      length_(longest_length(mechanism, setup)),
      sizes_(Vector::Zero(layout.columns())) {
  const Vector sizes = natural_sizes(mechanism, setup);
  for (Index i = 0; i < sizes.size(); ++i) {
    const Index column = layout.column[static_cast<std::size_t>(i)];
    if (column >= 0) {
      sizes_[column] = std::max(sizes_[column], sizes[i]);
    }
  }
  state_.setup = std::move(setup);
  state_.change = Vector::Zero(layout.columns());
  state_.errors = RowMatrix::Zero(poses.rows(), mechanism.leg_count());
  state_.poses = std::move(poses);
  tie_turns();
}

std::vector<LatentProblem::Turn> LatentProblem::turns_of(PoseSpace space, const Setup& setup,
                                                         Layout& layout) {
  const UnknownList list(setup);
  const auto& slots = frame_slots(space);
  std::vector<Turn> turns;
  if (std::find(slots.begin(), slots.end(), Index{3}) == slots.end()) {
    return turns;  // of one angle, which is a sum
  }
  for (const auto& [first, frame, drawn] :
       {std::tuple{list.base(), &Setup::base, &Setup::base_drawn},
        std::tuple{list.target(), &Setup::target, &Setup::target_drawn}}) {
    Turn turn{{}, {}, {}, first + 3, frame, (setup.*frame).rotation, Eigen::Vector3d::Zero()};
    bool tied = false;
    for (Index i = 0; i < 3; ++i) {
      const Index column = layout.column[static_cast<std::size_t>(turn.first + i)];
      if (column >= 0) {
        turn.free.push_back(i);
        turn.columns.push_back(column);
      } else {
        tied = tied || layout.is_free(turn.first + i);
        turn.held.push_back(i);
      }
    }
    if (turn.free.empty() || tied) {
      continue;
    }
    if (!turn.held.empty()) {
      turn.start = rotation_vector((setup.*frame).rotation * (setup.*drawn).transpose());
      turn.since = setup.*drawn;
    }
    for (const Index held : turn.held) {
      for (const Index column : turn.columns) {
        layout.ties.push_back({turn.first + held, column, 0});
      }
    }
    turns.push_back(std::move(turn));
  }
  return turns;
}

bool LatentProblem::turns_have_priors() const {
  return std::any_of(turns_.begin(), turns_.end(), [this](const Turn& turn) {
    return layout_.prior(turn.columns).array().isFinite().any();
  });
}

Eigen::Vector3d LatentProblem::turned(const Turn& turn) const {
  Eigen::Vector3d w = turn.start;
  w(turn.free) += state_.change(turn.columns);
  return w;
}

RowMatrix LatentProblem::by_step(const Turn& turn) const {
  const RowMatrix jacobian = left_jacobian(turned(turn))(turn.free, turn.free);
  return jacobian.inverse();
}

void LatentProblem::tie_turns() {
  for (const Turn& turn : turns_) {
    if (turn.held.empty()) {
      continue;
    }
    const Eigen::Matrix3d jacobian = left_jacobian(turned(turn));
    const RowMatrix factors = jacobian(turn.held, turn.free) * by_step(turn);
    for (Tie& tie : layout_.ties) {
      for (std::size_t i = 0; i < turn.held.size(); ++i) {
        for (std::size_t j = 0; j < turn.free.size(); ++j) {
          if (tie.scalar == turn.first + turn.held[i] && tie.column == turn.columns[j]) {
            tie.factor = factors(static_cast<Index>(i), static_cast<Index>(j));
          }
        }
      }
    }
    now_.rows.tie(layout_);
  }
}

RowMatrix LatentProblem::by_steps(RowMatrix rows) const {
  for (const Turn& turn : turns_) {
    const RowMatrix by_change = rows(kAll, turn.columns);
    rows(kAll, turn.columns) = by_change * by_step(turn);
  }
  return rows;
}

RowMatrix LatentProblem::prior_information() const {
  if (!turns_have_priors()) {
    return layout_.prior_information();
  }
  const RowMatrix rows = prior_rows();
  return product(rows.transpose(), rows);
}

void LatentProblem::take_in(Index pose, const double* start) {
  aside_[static_cast<std::size_t>(pose)] = false;
  state_.poses.row(pose) = Eigen::Map<const Eigen::RowVectorXd>(start, state_.poses.cols());
  state_.errors.row(pose).setZero();
  blocks_ = PoseBlocks(observations_, aside_);
}

bool LatentProblem::starts_near() const {
  return !losses_.any() && observations_.poses.any() && observations_.poses.values.allFinite();
}

LinearPose LatentProblem::general(Index pose) const {
  LinearPose linear = now_.rows.rows(pose);
  // A trial step may lead where there is nothing to eliminate, as to a target turned by half a
  // turn.
  if (!linear.misfit.allFinite() || !linear.by_pose.allFinite()) {
    linear.conditions = Vector::Constant(1, std::numeric_limits<double>::quiet_NaN());
    linear.jacobian = RowMatrix::Zero(1, layout_.columns());
    return linear;
  }
  linear.eliminate(pose);
  return linear;
}

LinearPose LatentProblem::linear(Index pose) const {
  const auto at = static_cast<std::size_t>(pose);
  if (aside_[at]) {
    LinearPose none;
    none.jacobian.resize(0, layout_.columns());
    return none;
  }
  return now_.general[at] ? now_.poses[at] : general(pose);
}

LatentProblem::Left LatentProblem::left(Index pose) const {
  const auto at = static_cast<std::size_t>(pose);
  if (aside_[at] || blocks_.first(pose) != pose) {
    return {Vector(0), RowMatrix(0, layout_.columns())};
  }
  if (const LinearBlock* of = block(pose)) {
    return {of->conditions(), of->jacobian()};
  }
  LinearPose alone = linear(pose);
  return {std::move(alone.conditions), std::move(alone.jacobian)};
}

WhitenedSystem LatentProblem::system() const {
  WhitenedSystem system;
  const RowMatrix priors = layout_.prior_rows();
  const Index conditions = std::accumulate(now_.counts.begin(), now_.counts.end(), Index{0});
  system.jacobian.setZero(conditions + priors.rows() + constraints_.rows(), layout_.columns());
  system.residual.setZero(system.jacobian.rows());
  for (std::size_t k = 0; k < now_.counts.size(); ++k) {
    if (now_.counts[k] > 0) {
      const Left pose = left(static_cast<Index>(k));
      const Index count = pose.conditions.size();
      system.jacobian.middleRows(system.rows(), count) = pose.jacobian;
      system.residual.segment(system.rows(), count) = pose.conditions;
      system.first.push_back(system.rows() + count);
    }
  }
  system.jacobian.middleRows(conditions, priors.rows()) = by_steps(priors);
  system.residual.segment(conditions, priors.rows()) = priors * state_.change;
  system.jacobian.bottomRows(constraints_.rows()) = by_steps(constraints_);
  system.residual.tail(constraints_.rows()) = constraints_ * state_.change;
  return system;
}

bool LatentProblem::linearise(NormalEquations& equations, bool gradient_alone) {
  const Index columns = layout_.columns();
  const Index n = observations_.count();
  const auto count = static_cast<std::size_t>(n);
  now_.rows.eliminate(state_.setup, state_.poses, state_.errors, aside_);
  equations.reset(columns);
  now_.general.assign(count, false);
  now_.blocks.clear();
  now_.counts.assign(count, 0);
  now_.chi_squares.setZero(n);
  now_.weights.setOnes(n);
  Vector in_lanes = Vector::Zero(n);  // weights of those that were eliminated together
  for (Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (aside_[at] || blocks_.first(i) != i) {
      continue;
    }
    if (!blocks_.alone(i)) {
      const LinearBlock& of =
          now_.blocks
              .emplace(i, block_rows(mechanism_, observations_, layout_, state_.setup, state_.poses,
                                     now_.rows, blocks_.of(i)))
              .first->second;
      now_.counts[at] = of.conditions().size();
      now_.chi_squares[i] = of.conditions().squaredNorm();
    } else if (now_.rows.eliminated(i)) {
      now_.counts[at] = now_.rows.count(i);
      now_.chi_squares[i] = now_.rows.chi_square(i);
      in_lanes[i] = 1;
    } else {
      now_.general[at] = true;
      now_.poses.resize(count);
      now_.poses[at] = general(i);
      now_.counts[at] = now_.poses[at].count();
      now_.chi_squares[i] = now_.poses[at].conditions.squaredNorm();
    }
    const double square = now_.chi_squares[i];
    if (!std::isfinite(square)) {
      return false;
    }
    double cost = square;
    if (losses_.any() && now_.counts[at] > 0) {
      const BlockLoss::Value value = losses_.of(now_.counts[at]).at(square);
      cost = value.cost;
      now_.weights[i] = value.weight;
      in_lanes[i] *= value.weight;
    }
    equations.cost += cost;
    const LinearBlock* const of = block(i);
    if (of != nullptr || now_.general[at]) {
      const RowMatrix& jacobian = of != nullptr ? of->jacobian() : now_.poses[at].jacobian;
      const Vector& conditions = of != nullptr ? of->conditions() : now_.poses[at].conditions;
      equations.information += now_.weights[i] * product(jacobian.transpose(), jacobian);
      equations.gradient += now_.weights[i] * (jacobian.transpose() * conditions);
    }
  }
  now_.rows.add_to(equations, in_lanes, gradient_alone);
  if (turns_have_priors()) {
    const RowMatrix rows = layout_.prior_rows();
    now_.prior_squares = add_rows(by_steps(rows), rows * state_.change, equations);
  } else {
    now_.prior_squares = state_.change.cwiseQuotient(layout_.prior).squaredNorm();
    equations.cost += now_.prior_squares;
    for (Index i = 0; i < columns; ++i) {
      const double precision = 1 / (layout_.prior[i] * layout_.prior[i]);
      equations.information(i, i) += precision;
      equations.gradient[i] += precision * state_.change[i];
    }
    if (layout_.relations.rows() > 0) {
      now_.prior_squares +=
          add_rows(layout_.relations, layout_.relations * state_.change, equations);
    }
  }
  if (!gradient_alone) {
    now_.information = equations.information;
  }
  if (constraints_.rows() > 0) {
    add_rows(by_steps(constraints_), constraints_ * state_.change, equations);
  }
  // Of sums of squares, of which no product is larger.
  return std::isfinite(equations.cost) && equations.information.diagonal().allFinite();
}

void LatentProblem::move_latent(Index pose, const double* tangent) {
  constexpr double kLargest = 0.3;
  const PoseSpace space = mechanism_.pose_space();
  const Index dof = mechanism_.dof(), position = position_size(space);
  double size = 0;
  for (Index i = 0; i < dof; ++i) {
    size = std::max(size, std::abs(tangent[i]) / (i < position ? length_ : 1));
  }
  std::array<double, 6> step{};
  std::transform(tangent, tangent + dof, step.begin(),
                 [&](double each) { return size > kLargest ? kLargest / size * each : each; });
  // A pose that says nothing of the parameters may wander about a double root.
  if (now_.counts[static_cast<std::size_t>(blocks_.first(pose))] > 0) {
    largest_move_ = std::max(largest_move_, size);
  }
  move_pose(space, step.data(), state_.poses.row(pose).data());
}

void LatentProblem::take_errors(const std::vector<RowOrigin>& origins, const Vector& errors) {
  for (std::size_t row = 0; row < origins.size(); ++row) {
    const RowOrigin& origin = origins[row];
    if (origin.kind == RowOrigin::Kind::closure && origin.by_error != 0) {
      state_.errors(origin.pose, origin.index) = errors[static_cast<Index>(row)] / origin.by_error;
    }
  }
}

void LatentProblem::step(const Vector& d) {
  saved_ = state_;
  last_move_ = largest_move_;
  largest_move_ = 0;
  now_.rows.move(d, tangents_, errors_);
  const Index dof = mechanism_.dof();
  for (Index i = 0; i < observations_.count(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (aside_[at] || blocks_.first(i) != i) {
      continue;
    }
    if (const LinearBlock* of = block(i)) {
      const std::vector<LinearBlock::Move> moves = of->moves(d);
      for (std::size_t k = 0; k < moves.size(); ++k) {
        const LinearPiece& piece = of->pieces()[k];
        take_errors(piece.rows.origins, moves[k].errors);
        for (std::size_t j = 0; j < piece.poses.size(); ++j) {
          move_latent(piece.poses[j], &moves[k].tangents[static_cast<Index>(j) * dof]);
        }
      }
    } else if (now_.general[at]) {
      const LinearPose& linear = now_.poses[at];
      const Vector errors = -linear.variances.cwiseProduct(
          linear.elimination.conditions * (linear.conditions + linear.jacobian * d));
      take_errors(linear.origins, errors);
      const Vector tangent =
          linear.elimination.solution * -(linear.misfit + linear.by_unknowns * d + errors);
      move_latent(i, tangent.data());
    } else {
      state_.errors.row(i) = errors_.row(i);
      move_latent(i, &tangents_(i, 0));
    }
  }
  move_setup(d);
}

void LatentProblem::finish(const Vector& d) {
  saved_.change = state_.change;
  move_setup(d);
}

void LatentProblem::move_setup(const Vector& d) {
  state_.setup = moved(std::move(state_.setup), layout_, d);
  state_.change += d;
  for (const Turn& turn : turns_) {
    Eigen::Matrix3d& rotation = (state_.setup.*turn.frame).rotation;
    if (turn.held.empty()) {
      state_.change(turn.columns) = rotation_vector(rotation * turn.since.transpose());
      continue;
    }
    state_.change(turn.columns) = saved_.change(turn.columns);
    state_.change(turn.columns) += by_step(turn) * d(turn.columns);
    rotation = rotation_of(turned(turn)) * turn.since;
  }
  tie_turns();
}

void LatentProblem::correct(const Vector& d) {
  State before = std::move(saved_);
  step(d);
  saved_ = std::move(before);
}

void LatentProblem::undo() {
  state_ = saved_;
  tie_turns();
  // Steps that fail are rare: what they cost is less than to keep two linearisations.
  NormalEquations again;
  linearise(again);
}

}  // namespace symkin
