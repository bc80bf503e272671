// SPDX-License-Identifier: MIT
#include "symkin/model/one_by_one_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "symkin/model/newton.hpp"
#include "symkin/model/pose.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// Poses side by side: what a leg needs once, such as a declared one for its assembly, costs more
// than a pose.
constexpr int kSide = 16;

// Of each a number, or whether something holds.
template <typename T>
struct Side {
  using Values = Eigen::Array<T, kSide, 1>;

  Side() = default;
  // NOLINTNEXTLINE(google-explicit-constructor)
  Side(T all) { lanes.fill(all); }
  template <typename Derived>
  // NOLINTNEXTLINE(google-explicit-constructor)
  Side(const Eigen::ArrayBase<Derived>& values) {
    Eigen::Map<Values>(lanes.data()) = values;
  }

  Eigen::Map<const Values> values() const { return Eigen::Map<const Values>(lanes.data()); }
  const T& operator[](int lane) const { return lanes[static_cast<std::size_t>(lane)]; }
  T& operator[](int lane) { return lanes[static_cast<std::size_t>(lane)]; }

  std::array<T, kSide> lanes{};
};
using Numbers = Side<double>;
using Masks = Side<bool>;

Numbers operator+(const Numbers& a, const Numbers& b) { return a.values() + b.values(); }
Numbers operator-(const Numbers& a, const Numbers& b) { return a.values() - b.values(); }
Numbers operator*(const Numbers& a, const Numbers& b) { return a.values() * b.values(); }
Numbers operator/(const Numbers& a, const Numbers& b) { return a.values() / b.values(); }
Numbers operator-(const Numbers& a) { return -a.values(); }
Numbers abs(const Numbers& a) { return a.values().abs(); }
Numbers sqrt(const Numbers& a) { return a.values().sqrt(); }
Masks operator<(const Numbers& a, const Numbers& b) { return a.values() < b.values(); }
Masks operator>(const Numbers& a, const Numbers& b) { return a.values() > b.values(); }
Masks operator<=(const Numbers& a, const Numbers& b) { return a.values() <= b.values(); }
Masks operator==(const Numbers& a, const Numbers& b) { return a.values() == b.values(); }
Masks operator==(const Masks& a, const Masks& b) { return a.values() == b.values(); }
Masks operator&&(const Masks& a, const Masks& b) { return a.values() && b.values(); }
Masks operator||(const Masks& a, const Masks& b) { return a.values() || b.values(); }
Masks operator!(const Masks& a) { return !a.values(); }

}  // namespace

template <>
struct Lanes<Numbers> {
  static constexpr int kCount = kSide;
  using Mask = Masks;

  static Numbers select(const Mask& mask, const Numbers& yes, const Numbers& no) {
    return mask.values().select(yes.values(), no.values());
  }
  static bool any(const Mask& mask) { return mask.values().any(); }
  static bool lane(const Mask& mask, int lane) { return mask[lane]; }
  static void cosine_sine(const Numbers& angle, Numbers& cosine, Numbers& sine) {
    cosine = angle.values().cos();
    sine = angle.values().sin();
  }
  static Numbers gather(const double* from, const Index* offsets) {
    Numbers all;
    for (int i = 0; i < kSide; ++i) {
      all[i] = from[offsets[i]];
    }
    return all;
  }
  static void scatter(const Numbers& value, double* to, const Index* offsets) {
    for (int i = 0; i < kSide; ++i) {
      to[offsets[i]] = value[i];
    }
  }
};

namespace {

// Legs of any chains as Newton's method takes them (see detail::Newton). Signs of dh/dq are told by
// those of dh/dpsi: a sensor's gain has the same at the start and at the end.
template <typename PoseType, std::size_t Closures>
class OneByOne {
  using Rows = detail::LaneRows<Numbers>;
  using Coordinates = std::array<Numbers, static_cast<std::size_t>(PoseType::kCoordinates)>;

  // By the pose's tangent.
  struct Slopes {
    const Numbers& operator[](Index k) const { return each[static_cast<std::size_t>(k)]; }
    Numbers& operator[](Index k) { return each[static_cast<std::size_t>(k)]; }

    std::array<Numbers, static_cast<std::size_t>(PoseType::kDof)> each;
  };

  struct Closure {
    Numbers a;
    Slopes v;
  };

  // What the sensor shows, what it would show at the start pose, and the side there: dh/dpsi > 0.
  struct LegState {
    Numbers reading, reading_at_start;
    Masks side;
  };

 public:
  using Source = const LegsOneByOne&;
  using Scalar = Numbers;
  using Pose = PoseType;
  static constexpr std::size_t kClosures = Closures;

  explicit OneByOne(const LegsOneByOne& legs) : source_(legs), legs_(legs.models.size()) {}

  std::size_t size() const { return legs_.size(); }

  void set_out(const Rows& rows, const double* readings, const Coordinates& start, bool sides) {
    last_ = static_cast<int>(rows.row(kSide - 1) - rows.row(0));
    ask(start, true);
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      LegState& leg = legs_[i];
      leg.reading = rows.read(readings + i, static_cast<Index>(legs_.size()));
      const Numbers root = this->root(i);
      leg.reading_at_start = Lanes<Numbers>::select(
          root == root, root, leg.reading);  // NOLINT(misc-redundant-expression)
      if (sides) {
        leg.side = slope(i, leg.reading_at_start) > 0;
      }
    }
  }

  const Coordinates& variable(const Coordinates& coordinates) {
    ask(coordinates, true);
    return coordinates;
  }

  std::array<Closure, kClosures> closures(std::size_t leg, const Coordinates& /*pose*/,
                                          bool at_start) const {
    const LegState& state = legs_[leg];
    linearise(leg, at_start ? state.reading_at_start : state.reading);
    std::array<Closure, kClosures> all;
    for (std::size_t c = 0; c < kClosures; ++c) {
      for (int lane = 0; lane < kSide; ++lane) {
        const Index row = place_[lane] * static_cast<Index>(kClosures) + static_cast<Index>(c);
        all[c].a[lane] = rows_.closure[row];
        for (Index k = 0; k < PoseType::kDof; ++k) {
          all[c].v[k][lane] = rows_.by_pose(row, k);
        }
      }
    }
    return all;
  }

  // Of the poses that were asked for last.
  Masks same_sides(const Coordinates& /*coordinates*/) const {
    Masks same(true);
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      same = same && (slope(i, legs_[i].reading) > 0) == legs_[i].side;
    }
    return same;
  }

  Masks in_working_modes(const Coordinates& coordinates) {
    constexpr double kTolerance = 1e-6;
    Masks all(true);
    for (const Numbers& each : coordinates) {
      all = all && each == each;  // NOLINT(misc-redundant-expression)
    }
    if (!all.values().any()) {
      return all;
    }
    ask(coordinates, all);
    Vector apart(kSide);
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const Numbers& reading = legs_[i].reading;
      const Numbers roots = root(i);
      model(i).reading_differences(parameters(i), roots.values().matrix(),
                                   reading.values().matrix(), apart);
      for (int lane = 0; lane < kSide; ++lane) {
        // A root that is not a number, just beyond the reach, fails the comparison too.
        const double gain = model(i).sensor_gain(parameters(i), reading[lane]);
        all[lane] = all[lane] && std::abs(apart[lane] * gain) < kTolerance;
      }
    }
    return all;
  }

 private:
  const LegModel& model(std::size_t leg) const { return *source_.models[leg]; }
  Eigen::Map<const Vector> parameters(std::size_t leg) const {
    return {source_.values[leg].parameters, model(leg).parameter_count()};
  }

  // Takes the poses of some lanes, those beyond the last row as that.
  void ask(const Coordinates& coordinates, const Masks& lanes) {
    asked_.clear();
    for (int lane = 0; lane < kSide; ++lane) {
      place_[lane] = std::max(static_cast<Index>(asked_.size()) - 1, Index{0});
      if (lane <= last_ && lanes[lane]) {
        place_[lane] = static_cast<Index>(asked_.size());
        asked_.push_back(lane);
      }
    }
    poses_.resize(static_cast<Index>(asked_.size()), PoseType::kCoordinates);
    for (std::size_t k = 0; k < coordinates.size(); ++k) {
      poses_.col(static_cast<Index>(k)) = coordinates[k].values()(asked_).matrix();
    }
  }

  // Where the leg stands at the poses that are asked for.
  Numbers root(std::size_t leg) const {
    Vector readings(poses_.rows());
    model(leg).inverse_kinematics(parameters(leg), source_.values[leg].working_mode, poses_,
                                  readings);
    return readings(place_).array();
  }

  Numbers slope(std::size_t leg, const Numbers& readings) const {
    linearise(leg, readings);
    return rows_.by_reading(place_ * static_cast<Index>(kClosures)).array();
  }

  void linearise(std::size_t leg, const Numbers& readings) const {
    const Vector own = readings.values()(asked_).matrix();
    model(leg).linearise_pose(parameters(leg), poses_, own, rows_);
  }

  const LegsOneByOne& source_;
  std::vector<LegState> legs_;
  int last_ = 0;                         // lane that stands for a row of its own
  std::vector<int> asked_;               // lanes that are asked for,
  RowMatrix poses_;                      // their poses,
  Eigen::Array<Index, kSide, 1> place_;  // and where among them each lane's is
  mutable ClosureRows rows_;             // of one leg at these poses, its room kept
};

template <typename Pose, std::size_t Closures = 1>
using NewtonOneByOne = detail::Newton<OneByOne<Pose, Closures>>;

using Forward = decltype(&NewtonOneByOne<PlanarPose<Numbers>>::forward);

// Legs that bind a platform carry one in space.
Forward newton_of(const ChainInfo& chain) {
  switch (chain.pose_space) {
    case PoseSpace::planar:
      return NewtonOneByOne<PlanarPose<Numbers>>::forward;
    case PoseSpace::point:
      return NewtonOneByOne<PointPose<Numbers>>::forward;
    case PoseSpace::translating:
      return NewtonOneByOne<TranslatingPose<Numbers>>::forward;
    case PoseSpace::spherical:
      return NewtonOneByOne<SphericalPose<Numbers>>::forward;
    case PoseSpace::schoenflies:
      return NewtonOneByOne<SchoenfliesPose<Numbers>>::forward;
    case PoseSpace::spatial:
      break;
  }
  return chain.closures == 1   ? NewtonOneByOne<SpatialPose<Numbers>>::forward
         : chain.closures == 2 ? NewtonOneByOne<SpatialPose<Numbers>, 2>::forward
                               : NewtonOneByOne<SpatialPose<Numbers>, 3>::forward;
}

}  // namespace

void forward_kinematics(const LegsOneByOne& legs, const RowMatrix& readings, ConstRows start,
                        const ForwardKinematicsOptions& options, RowMatrix& poses,
                        std::vector<ForwardStatus>& status) {
  constexpr Index kBlock = 256;  // between two looks for an interrupt
  const ChainInfo& chain = legs.models.front()->info();
  poses.resize(readings.rows(), coordinate_count(chain.pose_space));
  status.resize(static_cast<std::size_t>(readings.rows()));
  const Forward forward = newton_of(chain);
  const auto solve = [&](ConstRows from, const RowMatrix& to, int most, RowMatrix& found,
                         std::vector<ForwardStatus>& ends) {
    ForwardKinematicsOptions own = options;
    own.max_iterations = most;
    const Index stride = from.rows() == 1 ? 0 : from.outerStride();
    for (Index first = 0; first < to.rows(); first += kBlock) {
      check_interrupt();
      forward(legs, {from.data() + first * stride, stride, std::min(kBlock, to.rows() - first)},
              to.row(first).data(), own, found.row(first).data(),
              &ends[static_cast<std::size_t>(first)]);
    }
  };
  // Those beside a pose that has no end wait for it: first all with few steps, and then what is
  // left, from its start, with all that there are.
  constexpr int kFew = 12;
  solve(start, readings, std::min(options.max_iterations, kFew), poses, status);
  std::vector<Index> left;
  for (Index i = 0; options.max_iterations > kFew && i < readings.rows(); ++i) {
    if (status[static_cast<std::size_t>(i)] == ForwardStatus::diverged) {
      left.push_back(i);
    }
  }
  if (left.empty()) {
    return;
  }
  const RowMatrix from = start.rows() == 1 ? RowMatrix(start) : RowMatrix(start(left, kAll));
  RowMatrix found(static_cast<Index>(left.size()), poses.cols());
  std::vector<ForwardStatus> ends(left.size());
  solve(from, readings(left, kAll), options.max_iterations, found, ends);
  poses(left, kAll) = found;
  for (std::size_t k = 0; k < left.size(); ++k) {
    status[static_cast<std::size_t>(left[k])] = ends[k];
  }
}

}  // namespace symkin
