// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/model/mechanism.hpp"

namespace symkin {

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

// The same into a result that is there, for loops in real time: nothing is allocated where the
// result is of that size already and the mechanism has no more than eight legs.
void forward_kinematics(const Mechanism& mechanism, const RowMatrix& readings, ConstRows start,
                        const ForwardKinematicsOptions& options, ForwardKinematicsResult& result);

// Of legs that bind less than the platform's freedoms: the coordinates that they leave most freely
// at a pose, which with the readings determine it; none of other mechanisms.
std::vector<std::string> open_coordinates(const Mechanism& mechanism, ConstVector pose);

}  // namespace symkin
