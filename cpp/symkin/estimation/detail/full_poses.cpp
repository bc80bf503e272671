// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/full_poses.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace symkin {
namespace {

constexpr Index kMost = 16;  // legs

// Left Jacobian of the rotation vector w: exp(w + J^-1 d) = exp(d) exp(w) to first order.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  Eigen::Matrix3d cross;
  cross << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  const double square = angle * angle;
  const bool small = angle < 1e-4;
  const double a = small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
  const double b = small ? 1.0 / 6 - square / 120 : (angle - std::sin(angle)) / (square * angle);
  return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
}

bool equal(const double* values, Index count) {
  return std::all_of(values, values + count, [&](double value) { return value == values[0]; });
}

bool free_frame(const Layout& layout, Index first) {
  const auto begin = layout.column.begin() + first;
  return std::any_of(begin, begin + 6, [](Index column) { return column >= 0; });
}

}  // namespace

FullPoses::FullPoses(const Mechanism& mechanism, const Observations& observations,
                     const Layout& layout, const Setup& setup)
    : mechanism_(&mechanism),
      observations_(&observations),
      layout_(&layout),
      list_(setup),
      legs_(mechanism.leg_count()),
      dof_(mechanism.dof()),
      taken_(static_cast<std::size_t>(observations.count()), false),
      legs_read_(taken_.size(), 0) {
  const PoseSpace space = mechanism.pose_space();
  const Observed& poses = observations.poses;
  if (space == PoseSpace::spherical || !poses.any() || observations.reported.any() ||
      observations.points.any() || observations.distances.any() || observations.heights.any() ||
      mechanism.model().info().closures != 1 || free_frame(layout, list_.base()) ||
      free_frame(layout, list_.target())) {
    return;
  }
  const Index count = observations.count();
  const Frame from_device = setup.base.inverse();
  const Frame to_platform = setup.target.inverse();
  const bool turned = !setup.base.rotation.isIdentity(0);
  const Index position = position_size(space);
  measured_ = poses.values;
  for (Index i = 0; i < count; ++i) {
    const double* deviations = poses.deviations.row(i).data();
    // Deviations are those of the device's axes.
    if (!poses.values.row(i).allFinite() ||
        (turned &&
         !(equal(deviations, position) && equal(deviations + position, dof_ - position)))) {
      continue;
    }
    taken_[static_cast<std::size_t>(i)] = true;
    legs_read_[static_cast<std::size_t>(i)] =
        observations.readings.values.row(i).array().isFinite().count();
    pose_of_frame(space,
                  from_device * frame_of_pose(space, poses.values.row(i).data()) * to_platform,
                  measured_.row(i).data());
  }
  by_pose_.resize(count, legs_ * dof_);
  precisions_.resize(count, legs_ * legs_);
  multipliers_.resize(count, legs_);
  misfits_.resize(count, dof_);
  if (space == PoseSpace::spatial) {
    turns_.resize(count, 9);
  }
  chi_squares_ = Vector::Zero(count);
}

bool FullPoses::eliminate(const State& state, Index pose) {
  constexpr double kSingular = 1e-10;  // of a variance: what is left once the other legs are known
  if (legs_ > kMost) {
    return false;
  }
  const PoseSpace space = mechanism_->pose_space();
  const double* sigma = observations_->poses.deviations.row(pose).data();
  double* misfit = misfits_.row(pose).data();
  pose_difference(space, state.poses.row(pose).data(), measured_.row(pose).data(), misfit);
  if (turns_.size() > 0) {
    Eigen::Map<Eigen::Matrix3d>(turns_.row(pose).data()) =
        left_jacobian(Eigen::Map<const Eigen::Vector3d>(misfit + 3));
  }
  double conditions[kMost];
  double lower[kMost * kMost];  // the covariance, then its Cholesky factor
  Index n = 0;
  double* by_pose = by_pose_.row(pose).data();
  for (Index leg = 0; leg < legs_; ++leg) {
    if (!std::isfinite(observations_->readings.values(pose, leg))) {
      continue;
    }
    const ClosureRows& rows = state.legs[static_cast<std::size_t>(leg)];
    const double* h = rows.by_pose.row(pose).data();
    double* d = by_pose + n * dof_;
    std::copy(h, h + dof_, d);
    if (turns_.size() > 0) {
      Eigen::Map<Eigen::RowVector3d>(d + 3) =
          Eigen::Map<const Eigen::RowVector3d>(h + 3) *
          Eigen::Map<const Eigen::Matrix3d>(turns_.row(pose).data());
    }
    const double g = rows.by_reading[pose] * state.gains[static_cast<std::size_t>(leg)][pose];
    const double deviation = g * observations_->readings.deviations(pose, leg);
    double condition = rows.closure[pose] - g * state.errors(pose, leg);
    for (Index i = 0; i < dof_; ++i) {
      condition -= d[i] * misfit[i];
    }
    conditions[n] = condition;
    for (Index other = 0; other <= n; ++other) {
      double covariance = other == n ? deviation * deviation : 0;
      for (Index i = 0; i < dof_; ++i) {
        covariance += d[i] * by_pose[other * dof_ + i] * sigma[i] * sigma[i];
      }
      lower[n * kMost + other] = covariance;
    }
    ++n;
  }
  // Cholesky's factor in place, its inverse, and from that the precisions.
  double inverse[kMost * kMost];
  for (Index i = 0; i < n; ++i) {
    const double variance = lower[i * kMost + i];
    for (Index j = 0; j <= i; ++j) {
      double value = lower[i * kMost + j];
      for (Index k = 0; k < j; ++k) {
        value -= lower[i * kMost + k] * lower[j * kMost + k];
      }
      if (i != j) {
        lower[i * kMost + j] = value / lower[j * kMost + j];
      } else if (value > kSingular * variance) {
        lower[i * kMost + i] = std::sqrt(value);
      } else {
        return false;
      }
    }
    for (Index j = 0; j <= i; ++j) {
      double value = i == j ? 1 : 0;
      for (Index k = j; k < i; ++k) {
        value -= lower[i * kMost + k] * inverse[k * kMost + j];
      }
      inverse[i * kMost + j] = value / lower[i * kMost + i];
    }
  }
  double whitened[kMost];
  double square = 0;
  for (Index i = 0; i < n; ++i) {
    whitened[i] = 0;
    for (Index j = 0; j <= i; ++j) {
      whitened[i] += inverse[i * kMost + j] * conditions[j];
    }
    square += whitened[i] * whitened[i];
  }
  for (Index i = 0; i < n; ++i) {
    double multiplier = 0;
    for (Index k = i; k < n; ++k) {
      multiplier += inverse[k * kMost + i] * whitened[k];
    }
    multipliers_(pose, i) = multiplier;
    for (Index j = 0; j < n; ++j) {
      double precision = 0;
      for (Index k = std::max(i, j); k < n; ++k) {
        precision += inverse[k * kMost + i] * inverse[k * kMost + j];
      }
      precisions_(pose, i * n + j) = precision;
    }
  }
  chi_squares_[pose] = square;
  return true;
}

namespace {

// The columns of one leg and another, or the same, at the poses of a problem: to += a' diag(w) b,
// for widths that the compiler knows, and for any other (0).
template <int kWidth>
void add_outer(const double* a, const double* b, double weight, Index any_width, double* to,
               Index stride) {
  const Index width = kWidth > 0 ? kWidth : any_width;
  for (Index s = 0; s < width; ++s) {
    const double scaled = weight * a[s];
    double* row = to + s * stride;
    for (Index t = 0; t < width; ++t) {
      row[t] += scaled * b[t];
    }
  }
}

using AddOuter = void (*)(const double*, const double*, double, Index, double*, Index);

template <int... kWidths>
AddOuter add_outer_of(Index width, std::integer_sequence<int, kWidths...> /*widths*/) {
  constexpr AddOuter kKernels[] = {add_outer<kWidths>...};
  return width < static_cast<Index>(sizeof...(kWidths)) ? kKernels[width] : add_outer<0>;
}

}  // namespace

void FullPoses::add_to(NormalEquations& equations, const State& state, const Vector& weights,
                       const std::vector<bool>& others) {
  // In the legs' own scalars first, a block a pair of legs: every pose adds to the same few.
  const Index width = state.by_unknowns.front().cols();
  const AddOuter add = add_outer_of(width, std::make_integer_sequence<int, 17>());
  RowMatrix information = RowMatrix::Zero(legs_ * width, legs_ * width);
  Vector gradient = Vector::Zero(legs_ * width);
  std::vector<Index> read;
  for (Index pose = 0; pose < observations_->count(); ++pose) {
    if (!takes(pose) || others[static_cast<std::size_t>(pose)]) {
      continue;
    }
    read.clear();
    for (Index leg = 0; leg < legs_; ++leg) {
      if (std::isfinite(observations_->readings.values(pose, leg))) {
        read.push_back(leg);
      }
    }
    const auto n = static_cast<Index>(read.size());
    const double* precisions = precisions_.row(pose).data();
    for (Index i = 0; i < n; ++i) {
      const Index first = read[static_cast<std::size_t>(i)];
      const double* a = state.by_unknowns[static_cast<std::size_t>(first)].row(pose).data();
      const double force = weights[pose] * multipliers_(pose, i);
      double* to = gradient.data() + first * width;
      for (Index s = 0; s < width; ++s) {
        to[s] += force * a[s];
      }
      for (Index j = 0; j <= i; ++j) {
        const Index second = read[static_cast<std::size_t>(j)];
        const double* b = state.by_unknowns[static_cast<std::size_t>(second)].row(pose).data();
        add(a, b, weights[pose] * precisions[i * n + j], width,
            &information(first * width, second * width), information.cols());
      }
    }
  }
  std::vector<Index> columns(static_cast<std::size_t>(legs_ * width));
  for (Index leg = 0; leg < legs_; ++leg) {
    for (Index s = 0; s < width; ++s) {
      columns[static_cast<std::size_t>(leg * width + s)] =
          layout_->column[static_cast<std::size_t>(list_.leg(leg) + s)];
    }
  }
  for (Index i = 0; i < legs_ * width; ++i) {
    const Index row = columns[static_cast<std::size_t>(i)];
    if (row < 0) {
      continue;
    }
    equations.gradient[row] += gradient[i];
    // Blocks of a pair of legs were added once, those of one leg in full.
    const Index first_of_leg = i / width * width;
    for (Index j = 0; j < first_of_leg + width; ++j) {
      const Index column = columns[static_cast<std::size_t>(j)];
      if (column < 0) {
        continue;
      }
      equations.information(row, column) += information(i, j);
      if (j < first_of_leg) {
        equations.information(column, row) += information(i, j);
      }
    }
  }
}

Vector FullPoses::move(const State& state, Index pose, const Vector& d,
                       Eigen::Ref<Eigen::RowVectorXd> errors) const {
  const double* sigma = observations_->poses.deviations.row(pose).data();
  const Index n = count(pose);
  const double* by_pose = by_pose_.row(pose).data();
  double effects[kMost];
  Index read[kMost];
  Index found = 0;
  for (Index leg = 0; leg < legs_; ++leg) {
    if (!std::isfinite(observations_->readings.values(pose, leg))) {
      continue;
    }
    const RowMatrix& rows = state.by_unknowns[static_cast<std::size_t>(leg)];
    const double* row = rows.row(pose).data();
    const Index* columns = &layout_->column[static_cast<std::size_t>(list_.leg(leg))];
    double effect = 0;
    for (Index s = 0; s < rows.cols(); ++s) {
      effect += columns[s] < 0 ? 0 : row[s] * d[columns[s]];
    }
    effects[found] = effect;
    read[found++] = leg;
  }
  Vector move = -misfits_.row(pose).transpose();
  for (Index i = 0; i < n; ++i) {
    double multiplier = -multipliers_(pose, i);
    for (Index j = 0; j < n; ++j) {
      multiplier -= precisions_(pose, i * n + j) * effects[j];
    }
    for (Index k = 0; k < dof_; ++k) {
      move[k] += sigma[k] * sigma[k] * by_pose[i * dof_ + k] * multiplier;
    }
    const Index leg = read[i];
    const double g = state.legs[static_cast<std::size_t>(leg)].by_reading[pose] *
                     state.gains[static_cast<std::size_t>(leg)][pose];
    const double deviation = observations_->readings.deviations(pose, leg);
    errors[leg] = g * deviation * deviation * multiplier;
  }
  if (turns_.size() > 0) {
    const Eigen::Vector3d turned =
        Eigen::Map<const Eigen::Matrix3d>(turns_.row(pose).data()) * move.tail<3>();
    move.tail<3>() = turned;
  }
  return move;
}

}  // namespace symkin
