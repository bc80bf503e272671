// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "symkin/model/batched_leg.hpp"

namespace symkin::detail {

// A x = b by the cross products of the rows; b becomes x. Returns det A.
template <typename T>
T solve(std::array<std::array<T, 3>, 3>& a, std::array<T, 3>& b) {
  const auto cross = [](const std::array<T, 3>& u, const std::array<T, 3>& v) {
    return std::array<T, 3>{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                            u[0] * v[1] - u[1] * v[0]};
  };
  const auto c0 = cross(a[1], a[2]);
  const auto c1 = cross(a[2], a[0]);
  const auto c2 = cross(a[0], a[1]);
  const T determinant = a[0][0] * c0[0] + a[0][1] * c0[1] + a[0][2] * c0[2];
  const T inverse = 1.0 / determinant;
  const std::array<T, 3> right = b;
  for (std::size_t k = 0; k < 3; ++k) {
    b[k] = inverse * (c0[k] * right[0] + c1[k] * right[1] + c2[k] * right[2]);
  }
  return determinant;
}

// The same of any size by elimination, each lane with the largest pivot of its
// column.
template <std::size_t N, typename T>
T solve(std::array<std::array<T, N>, N>& a, std::array<T, N>& b) {
  using std::abs;
  using L = Lanes<T>;
  T determinant(1.0);
  for (std::size_t k = 0; k < N; ++k) {
    for (std::size_t i = k + 1; i < N; ++i) {
      const auto larger = abs(a[i][k]) > abs(a[k][k]);
      const auto exchange = [&](T& upper, T& lower) {
        const T kept = upper;
        upper = L::select(larger, lower, upper);
        lower = L::select(larger, kept, lower);
      };
      for (std::size_t j = k; j < N; ++j) {
        exchange(a[k][j], a[i][j]);
      }
      exchange(b[k], b[i]);
      determinant = L::select(larger, -determinant, determinant);
    }
    determinant = determinant * a[k][k];
    const T inverse = 1.0 / a[k][k];
    for (std::size_t i = k + 1; i < N; ++i) {
      const T factor = a[i][k] * inverse;
      for (std::size_t j = k + 1; j < N; ++j) {
        a[i][j] = a[i][j] - factor * a[k][j];
      }
      b[i] = b[i] - factor * b[k];
    }
    a[k][k] = inverse;
  }
  for (std::size_t k = N; k-- > 0;) {
    for (std::size_t j = k + 1; j < N; ++j) {
      b[k] = b[k] - a[k][j] * b[j];
    }
    b[k] = b[k] * a[k][k];
  }
  return determinant;
}

// Newton's method on the closures of all legs, which stay finite beyond reach, with halved steps;
// with more legs than degrees of freedom least squares (Gauss-Newton). Every lane is a pose on its
// own way: nothing in it depends on the other lanes.
// `Legs` is what it is asked of (see ChainLegs): made from a Legs::Source, of scalars Legs::Scalar,
//   set_out(rows, readings, start, sides)
//                                     reads the joints and, if asked, on which side of its
//                                     singularities (type 1) each leg is at the start
//   variable(coordinates)             the pose as closures() takes it
//   closures(leg, pose, at_start)     kClosures jets on the pose's tangent, with the joints as
//                                     they are read, or as they would stand at the start: an array
//                                     of them
//   same_sides(coordinates)           whether all legs are still on these sides there
//   in_working_modes(coordinates)     whether all legs stand in their working modes there
template <typename Legs>
class Newton {
  using T = typename Legs::Scalar;
  using Pose = typename Legs::Pose;
  using Rows = LaneRows<T>;
  using L = Lanes<T>;
  using Mask = typename L::Mask;
  static constexpr std::size_t kDof = Pose::kDof;
  static constexpr std::size_t kClosures = Legs::kClosures;
  using Coordinates = std::array<T, Pose::kCoordinates>;
  using Tangent = std::array<T, kDof>;
  using Matrix = std::array<Tangent, kDof>;

  // What the closures say at a pose.
  struct System {
    T cost;            // |h|^2
    T predicted;       // how much of it the step would take away, were h linear
    T largest;         // element of the step
    Tangent step;      // -J^-1 h
    Mask orientation;  // side of the singularities (type 2): det(dh/dpose) > 0
  };

 public:
  SYMKIN_FLATTEN static void forward(typename Legs::Source legs, PoseSpan start,
                                     const double* readings,
                                     const ForwardKinematicsOptions& options, double* poses,
                                     ForwardStatus* status) {
    Newton newton(legs, options);
    for (Index first = 0; first < start.count; first += L::kCount) {
      newton.solve(Rows(first, start.count), start, readings, poses, status);
    }
  }

 private:
  Newton(typename Legs::Source legs, const ForwardKinematicsOptions& options)
      : legs_(legs), options_(options) {}

  bool redundant() const { return legs_.size() * kClosures != kDof; }

  void solve(const Rows& rows, const PoseSpan& start, const double* readings, double* poses,
             ForwardStatus* status) {
    const T infinity(std::numeric_limits<double>::infinity());
    const T smallest(std::sqrt(options_.step_tolerance) * 1e-2);
    const T tolerance(options_.step_tolerance);
    const T next(redundant() ? 0.0 : 0.1 * options_.step_tolerance);
    Coordinates accepted = rows.template coordinates<Pose::kCoordinates>(start);
    legs_.set_out(rows, readings, accepted, redundant());
    Mask start_orientation{};
    Coordinates trial = accepted;
    Coordinates solution;
    solution.fill(T(std::numeric_limits<double>::quiet_NaN()));
    Tangent step;
    step.fill(T(0.0));
    T cost = infinity;
    T predicted(0.0);
    T tried(0.0);  // largest element of the step of which `scale` is being tried
    T scale(1.0);
    Mask active = cost == infinity;
    Mask solved = cost < infinity;
    Mask in_aspect = solved;
    // Before the first iteration, on which side of the singularities the start is.
    for (int i = redundant() ? 0 : -1; i < options_.max_iterations && L::any(active); ++i) {
      const System at = linearise(legs_.variable(trial), i < 0);
      if (i < 0) {
        start_orientation = at.orientation;
        continue;
      }
      // Against the predicted decrease, since the readings of a redundantly actuated mechanism with
      // errors leave a cost that no step takes away. Below sqrt(tolerance) rounding decides whether
      // the cost still falls.
      const T last = scale * tried;
      const Mask accept = active && (at.cost <= cost - 1e-4 * scale * predicted || last < smallest);
      // Settled too where the next step would be short enough if it shrank as this one has against
      // the last: Newton's steps shrink faster than that, but not those of least squares.
      const Mask settled =
          accept && (at.largest < tolerance || at.largest * at.largest < next * last);
      if (L::any(settled)) {
        const Mask same =
            redundant() ? legs_.same_sides(trial) : at.orientation == start_orientation;
        in_aspect = in_aspect || (settled && same);
        solved = solved || settled;
        Coordinates end = trial;
        Pose::move(at.step.data(), end.data());
        assign(settled, end, solution);
      }
      assign(accept, trial, accepted);
      assign(accept, at.step, step);
      cost = L::select(accept, at.cost, cost);
      predicted = L::select(accept, at.predicted, predicted);
      tried = L::select(accept, at.largest, tried);
      scale = L::select(accept, T(1.0), 0.5 * scale);
      // Given up where the step is not finite or too short.
      active =
          active && !settled && ((accept && at.largest < infinity) || (!accept && scale > T(1e-6)));
      trial = accepted;
      Tangent scaled;
      for (std::size_t k = 0; k < kDof; ++k) {
        scaled[k] = scale * step[k];
      }
      Pose::move(scaled.data(), trial.data());
    }
    if (!redundant()) {
      in_aspect = in_aspect && legs_.in_working_modes(solution);
    }
    for (int lane = 0; lane < L::kCount; ++lane) {
      status[rows.row(lane)] = L::lane(in_aspect, lane) ? ForwardStatus::converged
                               : L::lane(solved, lane)  ? ForwardStatus::left_aspect
                                                        : ForwardStatus::diverged;
    }
    for (std::size_t k = 0; k < solution.size(); ++k) {
      rows.write(solution[k], poses + k, static_cast<Index>(solution.size()));
    }
  }

  template <std::size_t N>
  static void assign(const Mask& mask, const std::array<T, N>& from, std::array<T, N>& to) {
    for (std::size_t k = 0; k < N; ++k) {
      to[k] = L::select(mask, from[k], to[k]);
    }
  }

  // `at_start` with the joints as they would stand there.
  template <typename VariablePose>
  System linearise(const VariablePose& pose, bool at_start) const {
    using std::abs;
    const bool squared = redundant();
    System system;
    system.cost = T(0.0);
    system.step.fill(T(0.0));
    Matrix matrix;
    for (Tangent& row : matrix) {
      row.fill(T(0.0));
    }
    std::size_t row = 0;
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      for (const auto& h : legs_.closures(i, pose, at_start)) {
        system.cost = system.cost + h.a * h.a;
        Tangent slope;
        for (std::size_t k = 0; k < kDof; ++k) {
          slope[k] = h.v[static_cast<Index>(k)];
        }
        if (!squared) {
          matrix[row] = slope;
          system.step[row++] = -h.a;
          continue;
        }
        for (std::size_t k = 0; k < kDof; ++k) {
          for (std::size_t j = 0; j < kDof; ++j) {
            matrix[k][j] = matrix[k][j] + slope[k] * slope[j];
          }
          system.step[k] = system.step[k] - slope[k] * h.a;
        }
      }
    }
    const Tangent gradient = system.step;
    const T determinant = detail::solve(matrix, system.step);
    system.predicted = system.cost;
    if (squared) {  // |J step|^2
      system.predicted = T(0.0);
      for (std::size_t k = 0; k < kDof; ++k) {
        system.predicted = system.predicted + gradient[k] * system.step[k];
      }
    }
    system.orientation = determinant > T(0.0);
    system.largest = abs(system.step[0]);
    T zero = 0.0 * system.step[0];  // not a number where the step is not finite
    for (std::size_t k = 1; k < kDof; ++k) {
      const T size = abs(system.step[k]);
      system.largest = L::select(size > system.largest, size, system.largest);
      zero = zero + 0.0 * size;
    }
    system.largest = system.largest + zero;
    return system;
  }

  Legs legs_;
  const ForwardKinematicsOptions& options_;
};

}  // namespace symkin::detail
