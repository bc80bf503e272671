// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "symkin/model/mechanism.hpp"

namespace symkin {

struct ForwardKinematicsOptions {
  int max_iterations = 50;
  double step_tolerance = 1e-10;  // m, rad: the last Newton step, which is still applied
  void check() const;
};

enum class ForwardStatus : std::uint8_t {
  converged,
  diverged,     // the closures have no solution that Newton's method reaches
  left_aspect,  // solved, but beyond a singularity: another assembly or working mode
};

struct ForwardKinematicsResult {
  RowMatrix poses;                    // N x coordinates; NaN where diverged
  std::vector<ForwardStatus> status;  // N
  Index converged_count() const;
};

// The poses that the mechanism takes at the readings (N x legs): Newton's method with halved steps
// on the closures, which stay finite beyond reach; with more legs than degrees of freedom, least
// squares (Gauss-Newton). `start` is one pose for all rows, or a pose a row. A solution counts
// only if every leg keeps its working mode and det(dh/dpose) the sign that it has at the start
// pose (the start's aspect).
ForwardKinematicsResult forward_kinematics(const Mechanism& mechanism, ConstRows readings,
                                           ConstRows start,
                                           const ForwardKinematicsOptions& options = {});

}  // namespace symkin
