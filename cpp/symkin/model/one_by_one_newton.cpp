// SPDX-License-Identifier: MIT
#include "symkin/model/one_by_one_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "symkin/model/newton.hpp"
#include "symkin/model/pose.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// Legs of any chains as Newton's method takes them (see detail::Newton). Signs of dh/dq are told by
// those of dh/dpsi: a sensor's gain has the same at the start and at the end.
template <typename PoseType, std::size_t Closures>
class OneByOne {
  using Rows = detail::LaneRows<double>;
  using Coordinates = std::array<double, PoseType::kCoordinates>;
  using Tangent = Jet<double, PoseType::kDof>;

  // What the sensor shows, what it would show at the start pose, and the side there: dh/dpsi > 0.
  struct LegState {
    double reading, reading_at_start;
    bool side;
  };

 public:
  using Source = const LegsOneByOne&;
  using Scalar = double;
  using Pose = PoseType;
  static constexpr std::size_t kClosures = Closures;

  explicit OneByOne(const LegsOneByOne& legs) : source_(legs), legs_(legs.models.size()) {}

  std::size_t size() const { return legs_.size(); }

  void set_out(const Rows& rows, const double* readings, const Coordinates& start, bool sides) {
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      LegState& leg = legs_[i];
      leg.reading = rows.read(readings + i, static_cast<Index>(legs_.size()));
      const double root = this->root(i, start);
      leg.reading_at_start = std::isnan(root) ? leg.reading : root;
      leg.side = sides && linearised(i, start, leg.reading_at_start).by_reading[0] > 0;
    }
  }

  const Coordinates& variable(const Coordinates& coordinates) const { return coordinates; }

  std::array<Tangent, kClosures> closures(std::size_t leg, const Coordinates& pose,
                                          bool at_start) const {
    const LegState& state = legs_[leg];
    const ClosureRows& rows =
        linearised(leg, pose, at_start ? state.reading_at_start : state.reading);
    std::array<Tangent, kClosures> all;
    for (std::size_t i = 0; i < kClosures; ++i) {
      const auto row = static_cast<Index>(i);
      all[i] = Tangent(rows.closure[row], rows.by_pose.row(row).transpose());
    }
    return all;
  }

  bool same_sides(const Coordinates& coordinates) const {
    bool same = true;
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      same =
          same && (linearised(i, coordinates, legs_[i].reading).by_reading[0] > 0) == legs_[i].side;
    }
    return same;
  }

  bool in_working_modes(const Coordinates& coordinates) const {
    constexpr double kTolerance = 1e-6;
    bool all = true;
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const Vector read = Vector::Constant(1, legs_[i].reading);
      const Vector root = Vector::Constant(1, this->root(i, coordinates));
      Vector apart(1);
      model(i).reading_differences(parameters(i), root, read, apart);
      // A root that is not a number, just beyond the reach, fails the comparison too.
      all = all && std::abs(apart[0] * model(i).sensor_gain(parameters(i), read[0])) < kTolerance;
    }
    return all;
  }

 private:
  using Row = Eigen::Map<const RowMatrix>;

  const LegModel& model(std::size_t leg) const { return *source_.models[leg]; }
  Eigen::Map<const Vector> parameters(std::size_t leg) const {
    return {source_.values[leg].parameters, model(leg).parameter_count()};
  }

  double root(std::size_t leg, const Coordinates& pose) const {
    Vector reading(1);
    model(leg).inverse_kinematics(parameters(leg), source_.values[leg].working_mode,
                                  Row(pose.data(), 1, Pose::kCoordinates), reading);
    return reading[0];
  }

  const ClosureRows& linearised(std::size_t leg, const Coordinates& pose, double reading) const {
    model(leg).linearise_pose(parameters(leg), Row(pose.data(), 1, Pose::kCoordinates),
                              Vector::Constant(1, reading), rows_);
    return rows_;
  }

  const LegsOneByOne& source_;
  std::vector<LegState> legs_;
  mutable ClosureRows rows_;  // of one leg at one pose, its room kept
};

template <typename Pose, std::size_t Closures = 1>
using NewtonOneByOne = detail::Newton<OneByOne<Pose, Closures>>;

using Forward = decltype(&NewtonOneByOne<PlanarPose<double>>::forward);

// Legs that bind a platform carry one in space.
Forward newton_of(const ChainInfo& chain) {
  switch (chain.pose_space) {
    case PoseSpace::planar:
      return NewtonOneByOne<PlanarPose<double>>::forward;
    case PoseSpace::point:
      return NewtonOneByOne<PointPose<double>>::forward;
    case PoseSpace::translating:
      return NewtonOneByOne<TranslatingPose<double>>::forward;
    case PoseSpace::spherical:
      return NewtonOneByOne<SphericalPose<double>>::forward;
    case PoseSpace::schoenflies:
      return NewtonOneByOne<SchoenfliesPose<double>>::forward;
    case PoseSpace::spatial:
      break;
  }
  return chain.closures == 1   ? NewtonOneByOne<SpatialPose<double>>::forward
         : chain.closures == 2 ? NewtonOneByOne<SpatialPose<double>, 2>::forward
                               : NewtonOneByOne<SpatialPose<double>, 3>::forward;
}

}  // namespace

void forward_kinematics(const LegsOneByOne& legs, const RowMatrix& readings, ConstRows start,
                        const ForwardKinematicsOptions& options, RowMatrix& poses,
                        std::vector<ForwardStatus>& status) {
  constexpr Index kBlock = 256;  // between two looks for an interrupt
  const ChainInfo& chain = legs.models.front()->info();
  poses.resize(readings.rows(), coordinate_count(chain.pose_space));
  status.resize(static_cast<std::size_t>(readings.rows()));
  const Index stride = start.rows() == 1 ? 0 : start.outerStride();
  const Forward forward = newton_of(chain);
  for (Index first = 0; first < readings.rows(); first += kBlock) {
    check_interrupt();
    forward(legs,
            {start.data() + first * stride, stride, std::min(kBlock, readings.rows() - first)},
            readings.row(first).data(), options, poses.row(first).data(),
            &status[static_cast<std::size_t>(first)]);
  }
}

}  // namespace symkin
