// SPDX-License-Identifier: MIT
#include "symkin/estimation/observed_rows.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "symkin/estimation/detail/latent_problem.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

class Linearised {
 public:
  Linearised(const Mechanism& mechanism, const Setup& setup, const Observations& observations,
             const Layout& layout, const ConstRows& poses)
      : mechanism_(mechanism),
        setup_(setup),
        observations_(observations),
        layout_(layout),
        poses_(poses),
        jacobians_(static_cast<std::size_t>(poses.rows())),
        residuals_(jacobians_.size()) {
    // Poses whose linearisations are held together: all, where something was measured between them.
    const Index together = observations.partners.cols() > 0 ? poses.rows() : Index{1024};
    for (Index first = 0; first < poses.rows(); first += together) {
      linearise(first, std::min(together, poses.rows() - first));
    }
  }

  ObservedRows rows() const {
    Index r = 0;
    for (const RowMatrix& jacobian : jacobians_) {
      r = std::max(r, jacobian.rows());
    }
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    ObservedRows all{RowMatrix::Zero(poses_.rows() * r, layout_.columns()),
                     Vector::Zero(poses_.rows() * r)};
    for (Index i = 0; i < poses_.rows(); ++i) {
      const RowMatrix& jacobian = jacobians_[static_cast<std::size_t>(i)];
      if (jacobian.cols() == 0) {
        all.jacobian.middleRows(i * r, r).setConstant(kNone);
        all.residual.segment(i * r, r).setConstant(kNone);
      } else {
        all.jacobian.middleRows(i * r, jacobian.rows()) = jacobian;
        all.residual.segment(i * r, jacobian.rows()) = residuals_[static_cast<std::size_t>(i)];
      }
    }
    return all;
  }

 private:
  void linearise(Index first, Index count) {
    check_interrupt();
    std::vector<Index> some(static_cast<std::size_t>(count));
    std::iota(some.begin(), some.end(), first);
    const Observations observed = observations_.of(some);
    const RowMatrix poses = poses_.middleRows(first, count);
    std::vector<bool> aside;
    for (Index i = 0; i < count; ++i) {
      aside.push_back(!poses.row(i).allFinite());
    }
    LatentProblem problem(mechanism_, observed, layout_, setup_, poses, aside);
    NormalEquations equations;
    if (!problem.linearise(equations)) {  // some pose cannot be linearised: find it
      if (count > 1) {
        linearise(first, count / 2);
        linearise(first + count / 2, count - count / 2);
      }
      return;
    }
    for (Index i = 0; i < count; ++i) {
      if (!aside[static_cast<std::size_t>(i)]) {
        LatentProblem::Left pose = problem.left(i);
        jacobians_[static_cast<std::size_t>(first + i)] = std::move(pose.jacobian);
        residuals_[static_cast<std::size_t>(first + i)] = std::move(pose.conditions);
      }
    }
  }

  const Mechanism& mechanism_;
  const Setup& setup_;
  const Observations& observations_;
  const Layout& layout_;
  const ConstRows& poses_;
  std::vector<RowMatrix> jacobians_;  // without columns where there is none
  std::vector<Vector> residuals_;
};

}  // namespace

ObservedRows observed_rows(const Mechanism& mechanism, const Setup& setup,
                           const Observations& observations, const Layout& layout,
                           ConstRows poses) {
  layout.check(mechanism, setup);
  observations.check(mechanism, setup);
  if (poses.rows() != observations.count() ||
      poses.cols() != coordinate_count(mechanism.pose_space())) {
    throw InvalidInput("the poses are " + std::to_string(poses.rows()) + " x " +
                       std::to_string(poses.cols()) + "; expected " +
                       std::to_string(observations.count()) + " x " +
                       std::to_string(coordinate_count(mechanism.pose_space())));
  }
  return Linearised(mechanism, setup, observations, layout, poses).rows();
}

}  // namespace symkin
