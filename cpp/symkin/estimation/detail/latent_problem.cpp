// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/latent_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/factors.hpp"
#include "symkin/model/sensor.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// The rows of a pose, gathered one by one.
class RowList {
 public:
  RowList(const Layout& layout, Index dof) : layout_(layout), dof_(dof) {}

  Index add(RowOrigin origin, double misfit, double variance) {
    const Index row = count_++;
    if (row == by_pose.rows()) {
      const Index more = std::max<Index>(2 * row, 16);
      by_pose.conservativeResize(more, dof_);
      by_unknowns.conservativeResize(more, layout_.columns());
      misfits.conservativeResize(more);
      variances.conservativeResize(more);
    }
    by_pose.row(row).setZero();
    by_unknowns.row(row).setZero();
    misfits[row] = misfit;
    variances[row] = variance;
    origins.push_back(origin);
    return row;
  }

  void set(Index row, Index scalar, double derivative) {
    const Index column = layout_.column[static_cast<std::size_t>(scalar)];
    if (column >= 0) {
      by_unknowns(row, column) += derivative;
    }
  }

  Index count() const { return count_; }

  std::vector<RowOrigin> origins;
  RowMatrix by_pose, by_unknowns;
  Vector misfits, variances;

 private:
  const Layout& layout_;
  Index dof_;
  Index count_ = 0;
};

// Rows of one kind of observation at one pose, those of its components that were measured:
// `component` of the kRows, or -1 for none, goes with each measured value's deviation.
template <typename Factor>
void add_factor(const factors::Scene<factors::Scalar>& scene, const std::vector<Index>& slots,
                const UnknownList& list, const double* own, Index own_scalar,
                const double* measured, const double* deviations, RowOrigin::Kind kind,
                Index first_index, const std::vector<Index>& components, RowList& rows) {
  using factors::Scalar;
  factors::Vec3<Scalar> own_values{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  if constexpr (Factor::kOwn) {
    for (int i = 0; i < 3; ++i) {
      own_values[static_cast<std::size_t>(i)] = Scalar(own[i], 18 + i);
    }
  }
  const auto misfit = Factor::template misfit<Scalar>(scene, own_values, measured);
  for (std::size_t k = 0; k < components.size(); ++k) {
    const double deviation = deviations[k];
    if (!std::isfinite(deviation)) {
      continue;
    }
    const Scalar& y = misfit[static_cast<std::size_t>(components[k])];
    const Index row =
        rows.add({kind, first_index + static_cast<Index>(k), 0}, y.a, deviation * deviation);
    for (std::size_t i = 0; i < slots.size(); ++i) {
      rows.by_pose(row, static_cast<Index>(i)) = y.v[slots[i]];
    }
    for (Index i = 0; i < 6; ++i) {
      rows.set(row, list.base() + i, y.v[6 + i]);
      rows.set(row, list.target() + i, y.v[12 + i]);
    }
    for (Index i = 0; Factor::kOwn && i < 3; ++i) {
      rows.set(row, own_scalar + i, y.v[18 + i]);
    }
  }
}

// Where a value is missing there is no row: marked by a deviation that is not finite.
std::vector<double> deviations_where_measured(const double* values, const double* deviations,
                                              Index count) {
  std::vector<double> found(static_cast<std::size_t>(count));
  for (Index i = 0; i < count; ++i) {
    found[static_cast<std::size_t>(i)] =
        std::isfinite(values[i]) ? deviations[i] : std::numeric_limits<double>::quiet_NaN();
  }
  return found;
}

}  // namespace

LatentProblem::LatentProblem(const Mechanism& mechanism, const Observations& observations,
                             const Layout& layout, Setup setup, RowMatrix poses,
                             std::vector<bool> aside)
    : mechanism_(mechanism),
      observations_(observations),
      layout_(layout),
      list_(setup),
      width_(mechanism.parameter_count()),
      aside_(std::move(aside)),
      constraints_(0, layout.columns()),
      now_{{}, FullPoses(mechanism, observations, layout, setup), {}, {}, {}, {}, {}, {}},
      length_(longest_length(mechanism, setup)),
      sizes_(Vector::Zero(layout.columns())) {
  const Vector sizes = natural_sizes(mechanism, setup);
  for (Index i = 0; i < sizes.size(); ++i) {
    const Index column = layout.column[static_cast<std::size_t>(i)];
    if (column >= 0) {
      sizes_[column] = std::max(sizes_[column], sizes[i]);
    }
  }
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (Index i = 0; i < UnknownList::kCurvature; ++i) {
      if (layout.column[static_cast<std::size_t>(list_.curvature(leg) + i)] >= 0) {
        width_ = mechanism.parameter_count() + UnknownList::kCurvature;
      }
    }
  }
  state_.setup = std::move(setup);
  state_.change = Vector::Zero(layout.columns());
  state_.errors = RowMatrix::Zero(poses.rows(), mechanism.leg_count());
  state_.poses = std::move(poses);
}

void LatentProblem::take_in(Index pose, const double* start) {
  aside_[static_cast<std::size_t>(pose)] = false;
  state_.poses.row(pose) = Eigen::Map<const Eigen::RowVectorXd>(start, state_.poses.cols());
  state_.errors.row(pose).setZero();
}

bool LatentProblem::starts_near() const {
  for (Index i = 0; i < observations_.count(); ++i) {
    if (!now_.full.takes(i)) {
      return false;
    }
  }
  return !losses_.any();
}

void LatentProblem::linearise_leg(Index leg, ClosureRows& rows) const {
  const LegModel& model = mechanism_.model(leg);
  const Index n = observations_.count();
  const Index closures = model.info().closures;
  const Index parameters = mechanism_.parameter_count();
  const CurvedSensor sensor = state_.setup.sensor(leg);
  Vector straight = state_.setup.parameters.row(leg);
  Vector readings = observations_.readings.values.col(leg) + state_.errors.col(leg);
  readings = readings.unaryExpr([](double value) { return std::isfinite(value) ? value : 0; });
  if (width_ == parameters && state_.setup.curvature.row(leg).isZero(0)) {
    model.linearise(straight, state_.poses, readings, rows);
  } else {
    // By the rows of a sensor that shows q itself.
    const Index geometry = parameters - LinearSensor::kParameters;
    straight.tail<LinearSensor::kParameters>() << 1, 0;
    ClosureRows own;
    model.linearise(straight, state_.poses,
                    readings.unaryExpr([&](double psi) { return sensor.active_joint(psi); }), own);
    rows.closure = own.closure;
    rows.by_pose = own.by_pose;
    rows.by_reading.resize(n * closures);
    rows.by_parameters.resize(n * closures, width_);
    rows.by_parameters.leftCols(geometry) = own.by_parameters.leftCols(geometry);
    for (Index at = 0; at < n * closures; ++at) {
      const double psi = readings[at / closures];
      const auto by_sensor = CurvedSensor::by_parameters(psi);
      rows.by_reading[at] = own.by_reading[at] * sensor.by_reading(psi);
      for (Index i = geometry; i < width_; ++i) {
        rows.by_parameters(at, i) =
            own.by_reading[at] * by_sensor[static_cast<std::size_t>(i - geometry)];
      }
    }
  }
  // The errors of a leg's rows are independent then: the reading is in one of them.
  rows.part_from_reading(closures);
  for (Index i = 0; i < n; ++i) {
    if (!std::isfinite(observations_.readings.values(i, leg))) {
      rows.closure.segment(i * closures, closures).setZero();
      rows.by_parameters.middleRows(i * closures, closures).setZero();
      rows.by_pose.middleRows(i * closures, closures).setZero();
      rows.by_reading.segment(i * closures, closures).setZero();
    }
  }
}

void LatentProblem::assemble(Index pose, LinearPose& linear) const {
  const PoseSpace space = mechanism_.pose_space();
  const Index dof = mechanism_.dof();
  const Index closures = mechanism_.closures();
  RowList rows(layout_, dof);

  for (Index leg = 0; leg < mechanism_.leg_count(); ++leg) {
    if (!std::isfinite(observations_.readings.values(pose, leg))) {
      continue;
    }
    const double deviation = observations_.readings.deviations(pose, leg);
    const ClosureRows& of_leg = now_.legs[static_cast<std::size_t>(leg)];
    for (Index at = pose * closures; at < (pose + 1) * closures; ++at) {
      const double g = of_leg.by_reading[at];
      const Index row = rows.add({RowOrigin::Kind::closure, leg, g},
                                 of_leg.closure[at] - g * state_.errors(pose, leg),
                                 g * g * deviation * deviation);
      rows.by_pose.row(row) = of_leg.by_pose.row(at);
      for (Index i = 0; i < width_; ++i) {
        rows.set(row, list_.leg(leg) + i, of_leg.by_parameters(at, i));
      }
    }
  }

  const Setup& setup = state_.setup;
  const std::vector<Index>& slots = pose_slots(space);
  const Index dimensions = position_size(space);
  std::vector<Index> positions, turns;  // components of the misfits that exist
  for (const Index slot : slots) {
    (slot < 3 ? positions : turns).push_back(slot < 3 ? slot : slot - 3);
  }
  const bool others = observations_.poses.any() || observations_.reported.any() ||
                      observations_.points.any() || observations_.distances.any() ||
                      observations_.heights.any();
  if (others) {
    const auto scene = factors::scene_of(frame_of_pose(space, state_.poses.row(pose).data()),
                                         setup.base, setup.target);
    const auto add_pose = [&](const Observed& observed, RowOrigin::Kind kind, auto position,
                              auto orientation) {
      if (!observed.any()) {
        return;
      }
      const double* values = observed.values.row(pose).data();
      const double* deviations = observed.deviations.row(pose).data();
      Vector known = Eigen::Map<const Vector>(values, observed.values.cols());
      const bool turned = known.tail(known.size() - dimensions).allFinite();
      if (!turned) {
        known.tail(known.size() - dimensions) =
            identity_pose(space).tail(known.size() - dimensions);
      }
      const Frame frame = frame_of_pose(space, known.data());
      double measured[12];
      std::copy_n(frame.position.data(), 3, measured);
      const Eigen::Matrix3d by_rows = frame.rotation.transpose();
      std::copy_n(by_rows.data(), 9, measured + 3);
      const std::vector<double> at = deviations_where_measured(values, deviations, dimensions);
      add_factor<decltype(position)>(scene, slots, list_, nullptr, 0, measured, at.data(), kind, 0,
                                     positions, rows);
      if (turned && !turns.empty()) {
        add_factor<decltype(orientation)>(scene, slots, list_, nullptr, 0, measured,
                                          deviations + dimensions, kind, dimensions, turns, rows);
      }
    };
    add_pose(observations_.poses, RowOrigin::Kind::pose, factors::MeasuredPosition(),
             factors::MeasuredOrientation());
    add_pose(observations_.reported, RowOrigin::Kind::reported, factors::ReportedPosition(),
             factors::ReportedOrientation());
    for (Index i = 0; observations_.points.any() && i < setup.points.rows(); ++i) {
      const Index first = i * dimensions;
      const double* values = &observations_.points.values(pose, first);
      double measured[3] = {0, 0, 0};
      std::copy(values, values + dimensions, measured);
      const std::vector<double> at = deviations_where_measured(
          values, &observations_.points.deviations(pose, first), dimensions);
      add_factor<factors::TargetPoint>(scene, slots, list_, setup.points.row(i).data(),
                                       list_.point(i), measured, at.data(), RowOrigin::Kind::point,
                                       first, positions, rows);
    }
    for (Index i = 0; observations_.distances.any() && i < setup.anchors.rows(); ++i) {
      const double* values = &observations_.distances.values(pose, i);
      const std::vector<double> at =
          deviations_where_measured(values, &observations_.distances.deviations(pose, i), 1);
      add_factor<factors::Distance>(scene, slots, list_, setup.anchors.row(i).data(),
                                    list_.anchor(i), values, at.data(), RowOrigin::Kind::distance,
                                    i, {0}, rows);
    }
    if (observations_.heights.any()) {
      const double* values = observations_.heights.values.row(pose).data();
      const std::vector<double> at =
          deviations_where_measured(values, observations_.heights.deviations.row(pose).data(), 1);
      add_factor<factors::Height>(scene, slots, list_, setup.plane.data(), list_.plane(), values,
                                  at.data(), RowOrigin::Kind::height, 0, {0}, rows);
    }
  }

  const Index m = rows.count();
  linear.origins = std::move(rows.origins);
  linear.misfit = rows.misfits.head(m);
  linear.variances = rows.variances.head(m);
  linear.by_unknowns = rows.by_unknowns.topRows(m);
  // A trial step may lead where there is nothing to eliminate, as to a target turned by half a
  // turn.
  if (!linear.misfit.allFinite() || !rows.by_pose.topRows(m).allFinite()) {
    linear.conditions = Vector::Constant(1, std::numeric_limits<double>::quiet_NaN());
    linear.jacobian = RowMatrix::Zero(1, layout_.columns());
    return;
  }
  linear.elimination = eliminate_pose(rows.by_pose.topRows(m), linear.variances, pose);
  const RowMatrix& g = linear.elimination.conditions;
  linear.conditions = g.transpose() * linear.misfit;
  linear.jacobian = product(g.transpose(), linear.by_unknowns);
}

LinearPose LatentProblem::linear(Index pose) const {
  const auto at = static_cast<std::size_t>(pose);
  LinearPose linear;
  linear.jacobian.resize(0, layout_.columns());
  if (now_.general[at]) {
    return now_.poses[at];
  }
  if (!aside_[at]) {
    assemble(pose, linear);
  }
  return linear;
}

PoseRows LatentProblem::rows_of(const LinearPose& pose, const RowMatrix& covariance) {
  const RowMatrix one = RowMatrix::Identity(pose.count(), pose.count());
  return {pose.origins,
          pose.variances,
          pose.elimination.conditions,
          one,
          one - product(product(pose.jacobian, covariance), pose.jacobian.transpose()),
          pose.conditions};
}

bool LatentProblem::linearise(NormalEquations& equations) {
  const Index columns = layout_.columns();
  const Index n = observations_.count();
  const auto count = static_cast<std::size_t>(n);
  now_.legs.resize(static_cast<std::size_t>(mechanism_.leg_count()));
  for (Index leg = 0; leg < mechanism_.leg_count(); ++leg) {
    linearise_leg(leg, now_.legs[static_cast<std::size_t>(leg)]);
  }
  equations.reset(columns);
  now_.general.assign(count, false);
  now_.counts.assign(count, 0);
  now_.chi_squares.setZero(n);
  now_.weights.setOnes(n);
  const FullPoses::State state{state_.poses, state_.errors, now_.legs};
  if (now_.full.any()) {
    now_.full.eliminate(state);
  }
  std::vector<Index> in_full;
  for (Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (aside_[at]) {
      continue;
    }
    if (now_.full.eliminated(i)) {
      now_.counts[at] = now_.full.count(i);
      now_.chi_squares[i] = now_.full.chi_square(i);
      in_full.push_back(i);
    } else {
      now_.general[at] = true;
      now_.poses.resize(count);
      assemble(i, now_.poses[at]);
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
    }
    equations.cost += cost;
    if (now_.general[at]) {
      const LinearPose& linear = now_.poses[at];
      equations.information +=
          now_.weights[i] * product(linear.jacobian.transpose(), linear.jacobian);
      equations.gradient += now_.weights[i] * (linear.jacobian.transpose() * linear.conditions);
    }
  }
  if (!in_full.empty()) {
    now_.full.add_to(equations, state, now_.weights, in_full);
  }
  for (Index i = 0; i < columns; ++i) {
    const double precision = 1 / (layout_.prior[i] * layout_.prior[i]);
    equations.information(i, i) += precision;
    equations.gradient[i] += precision * state_.change[i];
    equations.cost += precision * state_.change[i] * state_.change[i];
  }
  now_.information = equations.information;
  if (constraints_.rows() > 0) {
    const Vector off = constraints_ * state_.change;
    equations.information += product(constraints_.transpose(), constraints_);
    equations.gradient.noalias() += constraints_.transpose() * off;
    equations.cost += off.squaredNorm();
  }
  return std::isfinite(equations.cost) && equations.information.allFinite();
}

double LatentProblem::extent_of_pose(const Vector& move) const {
  const Index position = position_size(mechanism_.pose_space());
  double largest = 0;
  for (Index i = 0; i < move.size(); ++i) {
    largest = std::max(largest, std::abs(move[i]) / (i < position ? length_ : 1));
  }
  return largest;
}

void LatentProblem::step(const Vector& d) {
  constexpr double kLargest = 0.3;  // of a pose
  saved_ = state_;
  last_move_ = largest_move_;
  largest_move_ = 0;
  if (now_.full.any()) {
    now_.full.move({state_.poses, state_.errors, now_.legs}, d, moves_);
  }
  Vector tangent(mechanism_.dof());
  for (Index i = 0; i < observations_.count(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (aside_[at]) {
      continue;
    }
    if (now_.general[at]) {
      const LinearPose& linear = now_.poses[at];
      const Vector errors = -linear.variances.cwiseProduct(
          linear.elimination.conditions * (linear.conditions + linear.jacobian * d));
      tangent = linear.elimination.solution * -(linear.misfit + linear.by_unknowns * d + errors);
      for (std::size_t row = 0; row < linear.origins.size(); ++row) {
        const RowOrigin& origin = linear.origins[row];
        if (origin.kind == RowOrigin::Kind::closure && origin.by_error != 0) {
          state_.errors(i, origin.index) = errors[static_cast<Index>(row)] / origin.by_error;
        }
      }
    } else {
      tangent = moves_.tangents.row(i);
      state_.errors.row(i) = moves_.errors.row(i);
    }
    const double size = extent_of_pose(tangent);
    if (size > kLargest) {
      tangent *= kLargest / size;
    }
    // A pose that says nothing of the parameters may wander about a double root.
    if (now_.counts[at] > 0) {
      largest_move_ = std::max(largest_move_, size);
    }
    move_pose(mechanism_.pose_space(), tangent.data(), state_.poses.row(i).data());
  }
  state_.setup = moved(state_.setup, layout_, d);
  state_.change += d;
}

void LatentProblem::undo() {
  state_ = saved_;
  // Steps that fail are rare: what they cost is less than to keep two linearisations.
  NormalEquations again;
  linearise(again);
}

}  // namespace symkin
