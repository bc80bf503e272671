// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/frames_of_poses.hpp"

#include <cmath>
#include <utility>

namespace symkin {
namespace {

using Tangent = Eigen::Matrix<double, 6, 1>;
using ByFrames = Eigen::Matrix<double, 6, 12>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return cross;
}

// The misfit of a pair and its derivatives by the tangents of both frames.
Tangent misfit(const SeenPose& pair, const FramePair& frames, ByFrames& jacobian) {
  const Frame robot = frames.base * pair.robot;
  const Eigen::Vector3d place = robot.position + robot.rotation * frames.target.position;
  const Eigen::Vector3d turned =
      rotation_vector(robot.rotation * frames.target.rotation * pair.seen.rotation.transpose());
  const Eigen::Matrix3d by_turn = left_jacobian(turned).inverse();
  jacobian.setZero();
  jacobian.block<3, 3>(0, 0).setIdentity();
  jacobian.block<3, 3>(0, 3) = -cross_matrix(place - frames.base.position);
  jacobian.block<3, 3>(0, 6) = robot.rotation;
  jacobian.block<3, 3>(3, 3) = by_turn;
  jacobian.block<3, 3>(3, 9) = by_turn * robot.rotation;
  Tangent off;
  off << place - pair.seen.position, turned;
  return off;
}

Tangent moved_since(const Frame& start, const Frame& frame) {
  Tangent move;
  move << frame.position - start.position,
      rotation_vector(frame.rotation * start.rotation.transpose());
  return move;
}

}  // namespace

FramesOfPoses::FramesOfPoses(const std::vector<WeighedPose>& poses, const FramePair& start,
                             std::vector<Index> free, const Vector& priors, const Vector& sizes)
    : poses_(poses),
      start_(start),
      frames_(start),
      before_(start),
      free_(std::move(free)),
      priors_(priors),
      sizes_(sizes) {}

bool FramesOfPoses::linearise(NormalEquations& equations) const {
  Eigen::Matrix<double, 12, 12> information = Eigen::Matrix<double, 12, 12>::Zero();
  Eigen::Matrix<double, 12, 1> gradient = Eigen::Matrix<double, 12, 1>::Zero();
  double cost = 0;
  for (const WeighedPose& pose : poses_) {
    ByFrames jacobian;
    const Tangent off = pose.weights * misfit(pose.pair, frames_, jacobian);
    const ByFrames weighed = pose.weights * jacobian;
    information.noalias() += weighed.transpose() * weighed;
    gradient.noalias() += weighed.transpose() * off;
    cost += off.squaredNorm();
  }
  // What turns a frame since its start is a sum near enough for priors as loose as these.
  const Vector by_prior = change().cwiseQuotient(priors_);
  equations.information = information(free_, free_);
  equations.information.diagonal() += priors_.cwiseAbs2().cwiseInverse();
  equations.gradient = gradient(free_) + by_prior.cwiseQuotient(priors_);
  equations.cost = cost + by_prior.squaredNorm();
  return std::isfinite(equations.cost) && equations.information.allFinite();
}

void FramesOfPoses::step(const Vector& d) {
  before_ = frames_;
  Eigen::Matrix<double, 12, 1> tangents = Eigen::Matrix<double, 12, 1>::Zero();
  tangents(free_) = d;
  frames_ = {moved(frames_.base, tangents.head<6>()), moved(frames_.target, tangents.tail<6>())};
}

Vector FramesOfPoses::change() const {
  Eigen::Matrix<double, 12, 1> changes;
  changes << moved_since(start_.base, frames_.base), moved_since(start_.target, frames_.target);
  return changes(free_);
}

}  // namespace symkin
