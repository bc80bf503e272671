// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/whitened_closures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "symkin/estimation/detail/latent_poses.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// What these legs say of poses that were measured.
MeasurementSet read_by(const std::vector<Index>& legs, PoseSpace space, MeasurementSet measured) {
  const RowMatrix all = measured.readings;
  measured.readings.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (Index i = 0; i < all.rows(); ++i) {
    if (measured.poses.row(i).allFinite()) {
      measured.readings(i, legs) = all(i, legs);
    } else {
      measured.poses.row(i) = identity_pose(space);
    }
  }
  return measured;
}

std::vector<WhitenedPose> poses_of(const RowMatrix& readings, Index closures) {
  std::vector<WhitenedPose> poses;
  Index first = 0;
  for (Index row = 0; row < readings.rows(); ++row) {
    WhitenedPose pose{row, {}, closures, first, {}};
    for (Index leg = 0; leg < readings.cols(); ++leg) {
      if (std::isfinite(readings(row, leg))) {
        pose.legs.push_back(leg);
      }
    }
    if (!pose.legs.empty()) {
      first += pose.count();
      poses.push_back(std::move(pose));
    }
  }
  return poses;
}

void take_legs(const Mechanism& mechanism, const LatentPoses& latent, WhitenedClosures& system) {
  system.columns = {0};
  for (const Index leg : system.legs) {
    system.of_legs.push_back(latent.leg(leg));
    if (mechanism.closures() > 1) {
      mechanism.model(leg).linearise(mechanism.leg(leg).parameters, system.at.poses,
                                     system.at.readings.col(leg), system.of_legs.back());
    }
    system.columns.push_back(system.columns.back() + mechanism.estimated_count(leg));
    system.estimated.push_back(mechanism.estimated_parameters(leg));
  }
  system.poses = poses_of(system.at.readings, mechanism.closures());
  for (const WhitenedPose& pose : system.poses) {
    system.first.push_back(pose.first + pose.count());
  }
  system.residual.resize(system.rows());
  system.jacobian.setZero(system.rows(), system.columns.back());
}

// The latent pose has conditions of legs that were not read too. Of a leg's closures it knows the
// first, and of the others what is left once that has told the reading's error.
void take(const LatentPoses& latent, WhitenedPose& pose, WhitenedClosures& system) {
  std::vector<Index> own;
  for (const Index leg : pose.legs) {
    for (Index k = 0; k < pose.closures; ++k) {
      own.push_back(leg * pose.closures + k);
    }
  }
  system.residual.segment(pose.first, pose.count()) = latent.values(pose.row)(own);
  pose.units = latent.by_rows(pose.row).topRows(pose.count())(kAll, own).transpose();
  for (std::size_t i = 0; i < pose.legs.size(); ++i) {
    const auto place = static_cast<std::size_t>(system.position(pose.legs[i]));
    const ClosureRows& leg = system.of_legs[place];
    const Index row = pose.row * pose.closures;
    auto units = pose.units.middleCols(static_cast<Index>(i) * pose.closures, pose.closures);
    for (Index k = 1; k < pose.closures; ++k) {
      units.col(0) -= leg.by_reading[row + k] / leg.by_reading[row] * units.col(k);
    }
    const std::vector<Index>& estimated = system.estimated[place];
    system.jacobian.block(pose.first, system.columns[place], pose.count(),
                          static_cast<Index>(estimated.size())) =
        product(units, leg.by_parameters.middleRows(row, pose.closures)(kAll, estimated));
  }
}

}  // namespace

Index WhitenedClosures::position(Index leg) const {
  return std::find(legs.begin(), legs.end(), leg) - legs.begin();
}

WhitenedClosures whiten_closures(const Mechanism& mechanism, const MeasurementSet& measurements,
                                 const std::vector<Index>& legs, const MeasurementNoise& noise,
                                 LinearisedAt where, Index numbered) {
  const PoseSpace space = mechanism.pose_space();
  WhitenedClosures system;
  system.legs = legs;
  system.at = read_by(legs, space, measurements);
  const Observations observations = Observations::in_full(space, system.at, noise);
  const Setup setup = Setup::of(mechanism);
  const Layout layout = Layout::of_all_parameters(mechanism, setup);
  LatentPoses latent(mechanism, observations, layout, setup);
  RowMatrix errors = RowMatrix::Zero(observations.count(), mechanism.leg_count());
  const std::vector<bool> none(static_cast<std::size_t>(observations.count()), false);
  latent.eliminate(setup, system.at.poses, errors, none);
  if (where == LinearisedAt::likely) {
    RowMatrix tangents;
    latent.move(Vector::Zero(layout.columns()), tangents, errors);
    for (Index i = 0; i < tangents.rows(); ++i) {
      move_pose(space, tangents.row(i).data(), system.at.poses.row(i).data());
    }
    system.at.readings += errors;
    latent.eliminate(setup, system.at.poses, errors, none);
  }
  take_legs(mechanism, latent, system);
  for (WhitenedPose& pose : system.poses) {
    check_interrupt();
    if (!latent.eliminated(pose.row)) {
      throw_singular(numbered + pose.row, noise.reading == 0 && pose.count() > mechanism.dof());
    }
    take(latent, pose, system);
  }
  return system;
}

std::vector<Index> all_legs(Index count) {
  std::vector<Index> legs(static_cast<std::size_t>(count));
  std::iota(legs.begin(), legs.end(), Index{0});
  return legs;
}

}  // namespace symkin
