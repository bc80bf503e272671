// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "symkin/model/frame.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/model/sensor.hpp"

namespace symkin {

// What of a leg goes along with a covariate: a column that is known of every pose, such as the
// time.
struct LegCovariate {
  enum class Of {
    reading,  // the sensor shows slope times the covariate more
    lengths,  // every length is 1 + slope times the covariate times its own: see grows()
  };
  std::string name;
  Of of = Of::reading;
};

// The robot as it is measured: its legs, what their sensors do beside a straight line, and what
// stands around it. Every scalar of it may be unknown.
struct Setup {
  RowMatrix parameters;  // legs x p
  RowMatrix curvature;   // legs x 3, see CurvedSensor
  Frame base;            // the robot's base in the frame of the measuring device
  Frame target;          // what the device measures the pose of, in the platform's frame
  // Where both are turned by the drawing: where a part of a rotation is held, it is in the rotation
  // vector from here.
  Eigen::Matrix3d base_drawn = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d target_drawn = Eigen::Matrix3d::Identity();
  RowMatrix points;   // n x 3, further targets in the platform's frame, metres
  RowMatrix anchors;  // n x 3, fixed points that distances are measured from, device's frame
  // (c0, c1, c2, bow) of the bed z = c0 + c1 x + c2 y + bow (x^2 + y^2) / radius^2 of the base
  // frame that a probe touches.
  Eigen::Vector4d plane = Eigen::Vector4d::Zero();
  double bed_radius = 1;
  Vector zeros;  // of the distances, by how much more is true than is shown; all or none
  // What changes from pose to pose by covariates, see Observations; at zero the rest is what it is.
  std::vector<LegCovariate> leg_covariates;
  RowMatrix leg_slopes;  // legs x k
  std::vector<std::string> base_covariates;
  RowMatrix base_slopes;  // k x 6, of the base frame: components of the tangent

  // The drawing: straight sensors, the device in the robot's own frames, nothing else.
  static Setup of(const Mechanism& mechanism);

  // Of a leg with a straight sensor.
  CurvedSensor sensor(Index leg) const;
  // The reading at which the leg's model, which knows no curvature, has the joint where the sensor
  // shows `reading`.
  double model_reading(Index leg, double reading) const;
  // How much more the sensors of a leg show than is true, and how much longer its lengths are, over
  // themselves, at the poses of these covariates.
  Vector reading_shifts(Index leg, const RowMatrix& covariates) const;
  Vector growths(Index leg, const RowMatrix& covariates) const;
  // Where the base is at a pose with a row of the base's covariates.
  Frame base_at(const Eigen::Ref<const Eigen::RowVectorXd>& covariates) const;
};

// Every scalar of a setup, in one order: of each leg its parameters and the three terms of its
// sensor's curvature; the base frame and the target frame, six components of the tangent each; the
// points, the anchors, the plane, the zeros of distances; the slopes, of each leg one of each
// covariate, of the base six.
class UnknownList {
 public:
  explicit UnknownList(const Setup& setup);

  Index size() const { return base_slope(base_slopes_); }
  Index leg(Index leg) const { return leg * (parameters_ + kCurvature); }
  Index curvature(Index leg) const { return this->leg(leg) + parameters_; }
  Index base() const { return leg(legs_); }
  Index target() const { return base() + 6; }
  Index point(Index i) const { return target() + 6 + 3 * i; }
  Index anchor(Index i) const { return point(points_) + 3 * i; }
  Index plane() const { return anchor(anchors_); }
  Index zero(Index i) const { return plane() + 4 + i; }
  Index leg_slope(Index leg) const { return zero(zeros_) + leg * leg_slopes_; }
  Index base_slope(Index i) const { return leg_slope(legs_) + 6 * i; }

  static constexpr Index kCurvature = 3;

 private:
  Index legs_, parameters_, leg_slopes_, points_, anchors_, zeros_, base_slopes_;
};

// Names as files and options say them: "leg2.distal_length", "base.x", "target.rz", "point1.x",
// "anchor1.y", "plane.c1", "plane.bow", "distance1.zero", "leg1.drift", "drift.x". Empty for a
// scalar that the mechanism does not have, such as the z of a planar frame.
std::vector<std::string> unknown_names(const Mechanism& mechanism, const Setup& setup);

// Whether a parameter of a chain is a length that is there.
bool is_length(const ChainInfo& chain, const ParameterInfo& parameter);
// Whether it goes with the size of the robot: also by how much a length changes with a reading.
bool grows(const ChainInfo& chain, const ParameterInfo& parameter);
// For each leg the places of those, ascending.
std::vector<std::vector<Index>> growing_parameters(const Mechanism& mechanism);

// The robot's longest length; 1 of one that has none. Lengths are compared with it, so that nothing
// depends on their unit.
double longest_length(const Mechanism& mechanism, const Setup& setup);

// What a change of each scalar of the UnknownList is compared with: that length, a radian, a gain's
// own size, and what makes as much of the active joint.
Vector natural_sizes(const Mechanism& mechanism, const Setup& setup);

// A scalar that moves by so many times as much as a column.
struct Tie {
  Index scalar, column;
  double factor;
};

// Which scalars are estimated. A column of the estimate moves all scalars that name it by the same
// amount (shared over legs); a scalar without one is held, but for what ties make of it.
struct Layout {
  std::vector<Index> column;   // of each scalar of the UnknownList; -1: none of its own
  Vector prior;                // a column: standard deviation about the start, infinite: none
  std::vector<Tie> ties = {};  // of scalars without a column of their own, one a term
  // Priors of several columns together, such as of their difference: these rows, k x columns, times
  // the change since the start are independent and standard normal. None: 0 x 0.
  RowMatrix relations = {};
  Index columns() const { return prior.size(); }
  bool is_free(Index scalar) const;
  // All priors as such rows, those of one column first; and the squares of these.
  RowMatrix prior_rows() const;
  RowMatrix prior_information() const;

  // Every estimated parameter of every leg, leg by leg, without priors; all else is held.
  static Layout of_all_parameters(const Mechanism& mechanism, const Setup& setup);

  void check(const Mechanism& mechanism, const Setup& setup) const;  // throws InvalidInput
};

// The setup with its columns moved by `change`; rotations by R <- exp([w]) R.
Setup moved(Setup setup, const Layout& layout, ConstVector change);

}  // namespace symkin
