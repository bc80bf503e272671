// SPDX-License-Identifier: MIT
#include "symkin/symmetry/pair.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/model/pose.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

double turn_of_x(const Isometry& isometry) {
  return std::atan2(isometry.linear(1, 0), isometry.linear(0, 0));
}

Eigen::Matrix3d turn_about_z(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

// g X h^-1 takes h(b) to g(X b): the rotation R' = G R H^T, the position g(r) - R' t_h. Of the
// inverse pose, rotation R^T and position -R^T r, an exchange makes the same with h^-1 for h.
struct Motion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;
};

Motion image_of(const SymmetryPair& pair, const Motion& pose) {
  if (pair.exchange) {
    const Motion back{pose.rotation.transpose(), -(pose.rotation.transpose() * pose.position)};
    return image_of({pair.base, inverse(pair.platform), false}, back);
  }
  Motion image;
  image.rotation = pair.base.linear * pose.rotation * pair.platform.linear.transpose();
  image.position = pair.base(pose.position) - image.rotation * pair.platform.shift;
  return image;
}

void transform_spatial(const SymmetryPair& pair, double* pose) {
  Eigen::Map<Eigen::Vector3d> position(pose);
  const Motion image = image_of(pair, {rotation_matrix(pose + 3), position});
  position = image.position;
  Eigen::Map<Eigen::Vector4d>(pose + 3) = Eigen::Quaterniond(image.rotation).coeffs();
}

// The centre stays where it is.
void transform_spherical(const SymmetryPair& pair, double* quaternion) {
  const Motion image = image_of(pair, {rotation_matrix(quaternion), Eigen::Vector3d::Zero()});
  Eigen::Map<Eigen::Vector4d>(quaternion).noalias() = Eigen::Quaterniond(image.rotation).coeffs();
}

// By angles, which count turns and lose no digits.
void transform_planar(const SymmetryPair& pair, double* pose) {
  if (pair.exchange) {
    const Eigen::Vector3d back = -(turn_about_z(-pose[2]) * Eigen::Vector3d(pose[0], pose[1], 0));
    pose[0] = back.x();
    pose[1] = back.y();
    pose[2] = -pose[2];
    transform_planar({pair.base, inverse(pair.platform), false}, pose);
    return;
  }
  const double axes = turn_of_x(pair.base) - turn_of_x(pair.platform);
  const double phi = pair.improper() ? axes - pose[2] : pose[2] + axes;
  Eigen::Vector3d position = pair.base({pose[0], pose[1], 0});
  if (!pair.platform.shift.isZero(0)) {  // the usual one, which needs no cosine
    position -= turn_about_z(phi) * pair.platform.shift;
  }
  pose[0] = position.x();
  pose[1] = position.y();
  pose[2] = phi;
}

// The platform's turn stays one about Z, as does every pair that a platform of this kind has.
void transform_schoenflies(const SymmetryPair& pair, double* pose) {
  Eigen::Map<Eigen::Vector3d> position(pose);
  const Motion image = image_of(pair, {turn_about_z(pose[3]), position});
  position = image.position;
  pose[3] = std::atan2(image.rotation(1, 0), image.rotation(0, 0));
}

void transform_position(const SymmetryPair& pair, Index coordinates, double* pose) {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::copy_n(pose, coordinates, position.data());
  position = pair.base(position);
  std::copy_n(position.data(), coordinates, pose);
}

}  // namespace

bool mirrors(const Eigen::Matrix3d& linear) {
  return linear.col(0).cross(linear.col(1)).dot(linear.col(2)) < 0;
}

bool SymmetryPair::is_identity() const {
  return !exchange && base.linear.isIdentity(0) && platform.linear.isIdentity(0) &&
         base.shift.isZero(0) && platform.shift.isZero(0);
}

Isometry operator*(const Isometry& outer, const Isometry& inner) {
  return {outer.linear * inner.linear, outer(inner.shift)};
}

Isometry inverse(const Isometry& isometry) {
  return {isometry.linear.transpose(), -(isometry.linear.transpose() * isometry.shift)};
}

SymmetryPair compose(const SymmetryPair& outer, const SymmetryPair& inner) {
  const auto& [g1, h1, first] = outer;
  const auto& [g2, h2, second] = inner;
  if (first && second) {
    return {g1 * inverse(h2), inverse(h1) * g2, false};
  }
  if (first) {
    return {g1 * h2, inverse(g2) * h1, true};
  }
  return {g1 * g2, second ? h2 * inverse(h1) : h1 * h2, second};
}

SymmetryPair inverse(const SymmetryPair& pair) {
  if (pair.exchange) {
    return {pair.platform, pair.base, true};
  }
  return {inverse(pair.base), inverse(pair.platform), false};
}

double apart(const SymmetryPair& a, const SymmetryPair& b, double size) {
  if (a.exchange != b.exchange) {
    return std::numeric_limits<double>::infinity();
  }
  const auto most = [](const auto& matrix) { return matrix.cwiseAbs().maxCoeff(); };
  return std::max({most(a.base.linear - b.base.linear), most(a.platform.linear - b.platform.linear),
                   most(a.base.shift - b.base.shift) / size,
                   most(a.platform.shift - b.platform.shift) / size});
}

RowMatrix transform_poses(const SymmetryPair& pair, PoseSpace space, ConstRows poses) {
  if (poses.cols() != coordinate_count(space)) {
    throw InvalidInput("poses have " + std::to_string(poses.cols()) + " columns; a " +
                       std::string(to_string(space)) + " pose has " +
                       std::to_string(coordinate_count(space)));
  }
  if (pair.exchange && !has_orientation(space)) {
    throw InvalidInput("base and platform change roles only where the platform turns");
  }
  RowMatrix result = poses;
  for (Index i = 0; i < result.rows(); ++i) {
    double* const pose = result.row(i).data();
    if (space == PoseSpace::spatial) {
      transform_spatial(pair, pose);
    } else if (space == PoseSpace::spherical) {
      transform_spherical(pair, pose);
    } else if (space == PoseSpace::planar) {
      transform_planar(pair, pose);
    } else if (space == PoseSpace::schoenflies) {
      transform_schoenflies(pair, pose);
    } else {
      transform_position(pair, poses.cols(), pose);
    }
  }
  return result;
}

}  // namespace symkin
