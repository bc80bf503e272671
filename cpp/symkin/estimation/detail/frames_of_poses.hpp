// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/estimation/detail/closed_form_frames.hpp"
#include "symkin/estimation/detail/levenberg_marquardt.hpp"

namespace symkin {

// A robot's pose P that is exact, and what the device saw of it, Y = B P T, with its weights: the
// part of a tangent of six, in directions that are rows, over its deviation; zero where nothing was
// measured.
struct WeighedPose {
  SeenPose pair;
  Eigen::Matrix<double, 6, 6> weights;
};

// Both frames by least squares of the weighed
//   p = b + R_B (p_P + R_P t) - p_Y,   v = log(R_B R_P R_T R_Y')
// for `minimise`. Steps are tangents of B and T, b and R <- exp([d]) R, 12 of which some are free.
class FramesOfPoses {
 public:
  // Standard deviations of the change of what is free are `priors`, its natural sizes `sizes`.
  FramesOfPoses(const std::vector<WeighedPose>& poses, const FramePair& start,
                std::vector<Index> free, const Vector& priors, const Vector& sizes);

  Index size() const { return priors_.size(); }
  bool linearise(NormalEquations& equations) const;
  void step(const Vector& d);
  void undo() { frames_ = before_; }
  double step_size(const Vector& d) const { return d.cwiseQuotient(sizes_).cwiseAbs().maxCoeff(); }
  bool latents_at_rest() const { return true; }  // there are none

  const FramePair& frames() const { return frames_; }

 private:
  Vector change() const;  // of what is free since the start

  const std::vector<WeighedPose>& poses_;
  FramePair start_, frames_, before_;
  std::vector<Index> free_;
  const Vector &priors_, &sizes_;
};

}  // namespace symkin
