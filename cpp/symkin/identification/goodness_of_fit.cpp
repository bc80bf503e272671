// SPDX-License-Identifier: MIT
#include "symkin/identification/goodness_of_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "symkin/identification/robust_loss.hpp"
#include "symkin/identification/statistics.hpp"

namespace symkin {
namespace {

constexpr double kFalseAlarms = 1e-3;

}  // namespace

double GoodnessOfFit::spread() const {
  return unexplained() ? std::sqrt(chi_square / static_cast<double>(degrees_of_freedom)) : 1;
}

GoodnessOfFit goodness_of_fit(const WhitenedClosures& system, const Vector& weights,
                              Index problems) {
  Vector residual = system.residual;
  Eigen::MatrixXd jacobian = system.jacobian;
  Index kept = 0;
  for (std::size_t k = 0; k < system.poses.size(); ++k) {
    const WhitenedPose& pose = system.poses[k];
    if (weights[static_cast<Index>(k)] < kRejectedWeight) {
      residual.segment(pose.first, pose.count()).setZero();
      jacobian.middleRows(pose.first, pose.count()).setZero();
    } else {
      kept += pose.count();
    }
  }
  Vector lengths = jacobian.colwise().norm();
  lengths = (lengths.array() > 0).select(lengths, 1);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(jacobian *
                                                       lengths.cwiseInverse().asDiagonal());
  GoodnessOfFit fit;
  fit.legs = system.legs;
  fit.degrees_of_freedom = kept - qr.rank();
  residual.applyOnTheLeft(qr.householderQ().setLength(qr.rank()).adjoint());
  fit.chi_square = residual.tail(residual.size() - qr.rank()).squaredNorm();
  if (fit.degrees_of_freedom > 0) {
    const double alarms = kFalseAlarms / static_cast<double>(problems);
    fit.limit = chi_square_limit(fit.degrees_of_freedom, alarms);
    fit.least = chi_square_limit(fit.degrees_of_freedom, 1 - alarms);
  } else {
    fit.limit = fit.least = std::numeric_limits<double>::quiet_NaN();
  }
  return fit;
}

}  // namespace symkin
