// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/declared_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "symkin/chains/declared/recognition.hpp"
#include "symkin/chains/declared/side_by_side.hpp"
#include "symkin/model/one_by_one_newton.hpp"
#include "symkin/model/pose.hpp"
#include "symkin/model/sensor.hpp"
#include "symkin/support/error.hpp"

namespace symkin::declared {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Coordinates of a pose space's tangent among those of a rigid body.
std::vector<int> tangent_of(PoseSpace space) {
  switch (space) {
    case PoseSpace::planar:
      return {0, 1, 5};
    case PoseSpace::point:
      return {0, 1};
    case PoseSpace::translating:
      return {0, 1, 2};
    case PoseSpace::spherical:
      return {3, 4, 5};
    case PoseSpace::schoenflies:
      return {0, 1, 2, 5};
    case PoseSpace::spatial:
      break;
  }
  return {0, 1, 2, 3, 4, 5};
}

// The joint that is read; null of a leg without a reading.
const Joint* read_joint(const Declaration& declaration) {
  const std::vector<Joint>& joints = declaration.leg.joints;
  const auto read = [](const Joint& joint) { return joint.read; };
  const auto count = std::count_if(joints.begin(), joints.end(), read);
  if (count != 1 && !(count == 0 && declaration.closure >= 0)) {
    throw InvalidInput("a declared leg has " + std::to_string(count) +
                       " joints in brackets; expected one, since a leg has one reading");
  }
  const auto found = std::find_if(joints.begin(), joints.end(), read);
  return found == joints.end() ? nullptr : &*found;
}

ActiveJoint active_joint(const Declaration& declaration) {
  if (read_joint(declaration) == nullptr) {
    return ActiveJoint::joint_travel;  // by nothing
  }
  const Joint& joint = *read_joint(declaration);
  const bool along_y = std::abs(joint.axis.y()) > 0.5;
  if (joint.kind == JointKind::turn) {
    return along_y ? ActiveJoint::joint_turn : ActiveJoint::mirrored_joint_turn;
  }
  return along_y ? ActiveJoint::mirrored_joint_travel : ActiveJoint::joint_travel;
}

ChainInfo info_of(const Declaration& declaration, int closures, std::string_view known,
                  MirrorImage mirror_image) {
  const std::string& name = declaration.name;
  ChainInfo info{
      name,
      declaration.pose_space,
      {},
      active_joint(declaration),
      closures,
      false,
      "without meaning: the joints at home say how the leg stands",
      declaration.free,
      known,
      mirror_image,
      declaration.leg.loops.size() == 1 && declaration.leg.loops.front().length_joint >= 0,
      read_joint(declaration) != nullptr};
  if (declaration.closure >= 0) {
    if (declaration.closure >= (info.read ? 1 : closures)) {
      throw InvalidInput("chain " + name + " is closure " + std::to_string(declaration.closure) +
                         " of " + std::to_string(closures) + "; expected one of the leg's");
    }
    if (!info.read && declaration.pose_space != PoseSpace::spatial) {
      throw InvalidInput("chain " + name +
                         " has equations without a reading, which bind the platform; expected a "
                         "platform in space");
    }
    info.closures = 1;
    return info;
  }
  if (closures > 1 && declaration.pose_space != PoseSpace::spatial) {
    throw InvalidInput("chain " + name + " has " + std::to_string(closures) +
                       " equations for one reading, which bind the platform; expected a platform "
                       "in space");
  }
  if (closures > 3) {
    throw InvalidInput("chain " + name + " has " + std::to_string(closures) +
                       " equations for one reading; expected at most 3");
  }
  return info;
}

class DeclaredModel final : public ChainModel {
 public:
  // What is declared stays where it is: info and assembly look at it.
  DeclaredModel(std::shared_ptr<const Declaration> declaration, const Assembly& assembly,
                std::optional<Recognised> known)
      : ChainModel(with_parameters(*declaration,
                                   info_of(*declaration, assembly.closures(),
                                           known ? known->known().info().name : std::string_view(),
                                           assembly.mirror_image()))),
        known_(std::move(known)),
        declaration_(std::move(declaration)),
        assembly_(assembly),
        tangent_(tangent_of(declaration_->pose_space)),
        read_(info().read ? assembly.read().front() : -1) {
    find_places();
  }

  void inverse_kinematics(ConstVector parameters, int /*working_mode*/, ConstRows poses,
                          Eigen::Ref<Vector> readings) const override {
    if (Vector own; is_known(parameters, own)) {
      known_->known().inverse_kinematics(own, known_->working_mode(parameters), poses, readings);
      return;
    }
    Assembly leg = at(parameters);
    const SideBySide lanes(leg);
    const std::vector<Pose> all = each_pose(poses);
    std::vector<Closed> closed(all.size(), Closed::perhaps);
    std::vector<double> closed_at;
    if (lanes.possible()) {
      closed = lanes.close(all, closed_at);
    }
    const auto own = static_cast<std::size_t>(leg.home_joints().size());
    Joints joints;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const bool found = closed[i] == Closed::yes;
      if (found) {
        joints = Eigen::Map<const Vector>(&closed_at[i * own], leg.home_joints().size());
      }
      const bool closes = found || (closed[i] == Closed::perhaps && leg.close(all[i], joints));
      const bool read = closes && info().read;
      readings[static_cast<Index>(i)] = read ? sensor(parameters).reading(joints[read_], is_turn())
                                        : closes ? 0
                                                 : kNone;
    }
  }

  void reach_margin(ConstVector parameters, ConstRows poses,
                    Eigen::Ref<Vector> margins) const override {
    if (Vector own; is_known(parameters, own)) {
      known_->known().reach_margin(own, poses, margins);
      return;
    }
    Assembly leg = at(parameters);
    const std::vector<Pose> all = each_pose(poses);
    std::vector<Closed> closed(all.size(), Closed::perhaps);
    std::vector<double> together;
    if (const SideBySide lanes(leg); lanes.possible()) {
      closed = lanes.reach_margins(all, tangent_, together);
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      margins[static_cast<Index>(i)] = closed[i] == Closed::yes ? together[i]
                                       : closed[i] == Closed::no
                                           ? leg.missed(all[i])
                                           : leg.reach_margin(all[i], tangent_);
    }
  }

  void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                 ClosureRows& rows) const override {
    RowMatrix slopes;
    if (Vector own; is_known(parameters, own, &slopes)) {
      known_->known().linearise(own, poses, readings, rows);
      rows.by_parameters = (rows.by_parameters * slopes).eval();
      return;
    }
    const auto count = static_cast<Index>(declaration_->leg.scalars.size());
    rows.by_parameters.setZero(poses.rows() * info().closures, parameter_count());
    const auto write = [&](Index row, double reading, double by_joint, const double* scalars) {
      auto slopes = rows.by_parameters.row(row);
      slopes.head(count) = Eigen::Map<const Vector>(scalars, count).transpose();
      if (info().read) {
        const auto of_sensor = sensor(parameters).by_parameters(reading);
        slopes[count + 1] = by_joint * of_sensor[0];
        slopes[count + 2] = by_joint * of_sensor[1];
      }
    };
    each_closure(parameters, poses, readings, rows, write);
  }

  void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                      ClosureRows& rows) const override {
    if (Vector own; is_known(parameters, own)) {
      known_->known().linearise_pose(own, poses, readings, rows);
      return;
    }
    each_closure(parameters, poses, readings, rows, [](Index, double, double, const double*) {});
  }

  void reading_differences(ConstVector parameters, ConstVector readings, ConstVector others,
                           Eigen::Ref<Vector> differences) const override {
    for (Index i = 0; i < readings.size(); ++i) {
      differences[i] = sensor(parameters).difference(readings[i], others[i], is_turn());
    }
  }

  double sensor_gain(ConstVector parameters, double /*reading*/) const override {
    return sensor(parameters).gain;
  }

  RowMatrix joint_centres(ConstVector parameters, ConstVector pose, double reading) const override {
    Assembly leg = at(parameters);
    Joints joints = leg.home_joints();
    if (info().read) {
      joints[read_] = sensor(parameters).active_joint(reading);
    }
    leg.close_around_readings(pose_of(info().pose_space, pose.data()), joints);
    const auto all = places(leg);
    const Index size = planar() ? 2 : 3;
    RowMatrix centres(static_cast<Index>(places_.size()), size);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      centres.row(static_cast<Index>(i)) = all[places_[i]].head(size).transpose();
    }
    return centres;
  }

  RowMatrix inverse_kinematics(const Legs& legs, ConstRows poses) const override {
    if (const KnownLegs known(*this, legs); known.all()) {
      return known_->known().inverse_kinematics(known.legs(), poses);
    }
    RowMatrix readings(poses.rows(), static_cast<Index>(legs.size()));
    Vector of_leg(poses.rows());
    for (std::size_t i = 0; i < legs.size(); ++i) {
      inverse_kinematics(parameters_of(legs[i]), 1, poses, of_leg);
      readings.col(static_cast<Index>(i)) = of_leg;
    }
    return readings;
  }

  RowMatrix reach_margin(const Legs& legs, ConstRows poses) const override {
    if (const KnownLegs known(*this, legs); known.all()) {
      return known_->known().reach_margin(known.legs(), poses);
    }
    RowMatrix margins(poses.rows(), static_cast<Index>(legs.size()));
    Vector of_leg(poses.rows());
    for (std::size_t i = 0; i < legs.size(); ++i) {
      reach_margin(parameters_of(legs[i]), poses, of_leg);
      margins.col(static_cast<Index>(i)) = of_leg;
    }
    return margins;
  }

  PoseDerivatives linearise_pose(const Legs& legs, ConstRows poses,
                                 const RowMatrix& readings) const override {
    if (const KnownLegs known(*this, legs); known.all()) {
      return known_->known().linearise_pose(known.legs(), poses, readings);
    }
    const auto closures = static_cast<Index>(info().closures);
    const auto dof = static_cast<Index>(tangent_.size());
    const auto columns = static_cast<Index>(legs.size()) * closures;
    PoseDerivatives all;
    all.closure.resize(poses.rows(), columns);
    all.by_pose.resize(poses.rows(), columns * dof);
    all.by_reading.resize(poses.rows(), columns);
    ClosureRows rows;
    for (Index leg = 0; leg < static_cast<Index>(legs.size()); ++leg) {
      linearise_pose(parameters_of(legs[static_cast<std::size_t>(leg)]), poses, readings.col(leg),
                     rows);
      for (Index i = 0; i < poses.rows(); ++i) {
        const auto own = Eigen::seqN(i * closures, closures);
        const Index first = leg * closures;
        all.closure.row(i).segment(first, closures) = rows.closure(own).transpose();
        all.by_reading.row(i).segment(first, closures) = rows.by_reading(own).transpose();
        all.by_pose.row(i).segment(first * dof, closures * dof) =
            Eigen::Map<const RowMatrix>(rows.by_pose.row(i * closures).data(), 1, closures * dof);
      }
    }
    return all;
  }

  void forward_kinematics(const Legs& legs, const RowMatrix& readings, ConstRows start,
                          const ForwardKinematicsOptions& options, RowMatrix& poses,
                          std::vector<ForwardStatus>& status) const override {
    if (const KnownLegs known(*this, legs); known.all()) {
      known_->known().forward_kinematics(known.legs(), readings, start, options, poses, status);
      return;
    }
    symkin::forward_kinematics({std::vector<const LegModel*>(legs.size(), this), legs}, readings,
                               start, options, poses, status);
  }

 private:
  bool is_known(ConstVector parameters, Vector& own, RowMatrix* slopes = nullptr) const {
    return known_ && known_->parameters(parameters, own, slopes);
  }

  // Legs as the known chain has them, unless one of them is none of its.
  class KnownLegs {
   public:
    KnownLegs(const DeclaredModel& model, const Legs& legs) : all_(model.known_.has_value()) {
      own_.resize(all_ ? legs.size() : 0);
      for (std::size_t i = 0; i < own_.size(); ++i) {
        const auto parameters = model.parameters_of(legs[i]);
        all_ = all_ && model.known_->parameters(parameters, own_[i], nullptr);
        legs_.push_back({own_[i].data(), model.known_->working_mode(parameters)});
      }
    }
    bool all() const { return all_; }
    const Legs& legs() const { return legs_; }

   private:
    bool all_;
    std::vector<Vector> own_;
    Legs legs_;
  };

  static ChainInfo with_parameters(const Declaration& declaration, ChainInfo info) {
    for (const Scalar& scalar : declaration.leg.scalars) {
      info.parameters.push_back({scalar.name, scalar.role, scalar.held});
    }
    info.parameters.push_back({"hand", {End::none, ParameterKind::handedness}});
    for (const ParameterInfo& each : LinearSensor::kParameterInfos) {
      info.parameters.push_back({each.name, each.role, !info.read});
    }
    return info;
  }

  bool planar() const {
    return info().pose_space == PoseSpace::planar || info().pose_space == PoseSpace::point;
  }
  bool is_turn() const { return is_angle(info().active_joint); }
  Pose pose(ConstRows poses, Index row) const {
    return pose_of(info().pose_space, poses.row(row).data());
  }
  LinearSensor sensor(ConstVector parameters) const {
    return LinearSensor(parameters.data() + declaration_->leg.scalars.size() + 1);
  }
  Eigen::Map<const Vector> parameters_of(const LegValues& leg) const {
    return {leg.parameters, parameter_count()};
  }

  std::vector<Pose> each_pose(ConstRows poses) const {
    std::vector<Pose> all;
    all.reserve(static_cast<std::size_t>(poses.rows()));
    for (Index i = 0; i < poses.rows(); ++i) {
      all.push_back(pose(poses, i));
    }
    return all;
  }

  Assembly at(ConstVector parameters) const {
    const auto count = static_cast<Index>(declaration_->leg.scalars.size());
    Assembly leg = assembly_;
    leg.set_leg(parameters.head(count), parameters[count] < 0);
    return leg;
  }

  // Closures, and their derivatives by pose and reading; `visit` takes each row's work.
  template <typename Visit>
  void each_closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                    ClosureRows& rows, const Visit& visit) const {
    const auto closures = static_cast<Index>(info().closures);
    rows.closure.resize(poses.rows() * closures);
    rows.by_pose.resize(rows.closure.size(), static_cast<Index>(tangent_.size()));
    rows.by_reading.resize(rows.closure.size());
    Assembly leg = at(parameters);
    const LinearSensor sensor = this->sensor(parameters);
    const int first = std::max(declaration_->closure, 0);
    const auto scalars = static_cast<Index>(declaration_->leg.scalars.size());
    const auto write = [&](Index i, Index row, const double* numbers) {
      const double by_joint = numbers[kClosureNumbers - 1];
      rows.closure[row] = numbers[0];
      for (std::size_t k = 0; k < tangent_.size(); ++k) {
        rows.by_pose(row, static_cast<Index>(k)) = numbers[1 + tangent_[k]];
      }
      rows.by_reading[row] = info().read ? sensor.gain * by_joint : 0;
      visit(row, readings[i], by_joint, numbers + kClosureNumbers);
    };
    Vector read = Vector::Constant(poses.rows(), kNone);
    for (Index i = 0; info().read && i < poses.rows(); ++i) {
      read[i] = sensor.active_joint(readings[i]);
    }
    const std::vector<Pose> all = each_pose(poses);
    std::vector<Closed> closed(all.size(), Closed::perhaps);
    RowMatrix together;
    if (const SideBySide lanes(leg); lanes.possible()) {
      together.resize(rows.closure.size(), kClosureNumbers + scalars);
      closed = lanes.closures(all, read, first, info().closures, together);
    }
    Joints joints = leg.home_joints();
    Work work;
    Vector alone(kClosureNumbers + scalars);
    for (Index i = 0; i < poses.rows(); ++i) {
      if (closed[static_cast<std::size_t>(i)] == Closed::yes) {
        for (Index row = i * closures; row < (i + 1) * closures; ++row) {
          write(i, row, together.row(row).data());
        }
        continue;
      }
      if (info().read) {
        joints[read_] = read[i];
      }
      leg.close_around_readings(all[static_cast<std::size_t>(i)], joints);
      const Columns& wrenches = leg.reciprocal();
      const Equations residual = leg.loops().residual();
      for (Index c = 0; c < closures; ++c) {
        leg.loops().work(wrenches.col(first + c), work);
        alone << wrenches.col(first + c).dot(residual), work.pose,
            info().read ? work.joints[read_] : 0,
            Eigen::Map<const Vector>(work.scalars.data(), scalars);
        write(i, i * closures + c, alone.data());
      }
    }
  }

  std::vector<Eigen::Vector3d> places(const Assembly& leg) const {
    const int joint = read_ < 0 ? -1 : leg.loops().own()[static_cast<std::size_t>(read_)];
    return leg.loops().places(info().pose_space == PoseSpace::spherical, joint);
  }

  // Of joints that stand in one place as drawn one is shown.
  void find_places() {
    constexpr double kApart = 1e-9;
    Assembly leg = assembly_;
    Joints joints = leg.home_joints();
    leg.close_around_readings(pose_of(info().pose_space, declaration_->home_pose.data()), joints);
    const auto all = places(leg);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (places_.empty() || (all[i] - all[places_.back()]).norm() > kApart) {
        places_.push_back(i);
      } else {
        places_.back() = i;  // the platform's point rather than the joint that holds it
      }
    }
  }

  std::optional<Recognised> known_;
  std::shared_ptr<const Declaration> declaration_;
  Assembly assembly_;
  std::vector<int> tangent_;
  int read_;  // -1 where nothing is
  std::vector<std::size_t> places_;
};

}  // namespace

Pose pose_of(PoseSpace space, const double* row) {
  Pose pose;
  const Index size = position_size(space);
  pose.position.head(size) = Eigen::Map<const Vector>(row, size);
  if (has_angle(space)) {
    const double cosine = std::cos(row[size]);
    const double sine = std::sin(row[size]);
    pose.rotation.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  } else if (has_quaternion(space)) {
    pose.rotation = rotation_matrix(row + size);
  }
  return pose;
}

std::unique_ptr<const ChainModel> declared_model(const Declaration& declaration) {
  static_cast<void>(read_joint(declaration));  // throws where there are several
  auto lasting = std::make_shared<const Declaration>(declaration);
  const Assembly assembly(lasting->leg, {pose_of(lasting->pose_space, lasting->home_pose.data()),
                                         lasting->home_joints});
  std::optional<Recognised> known =
      lasting->recognise && lasting->closure < 0 ? recognised(*lasting) : std::nullopt;
  return std::make_unique<DeclaredModel>(std::move(lasting), assembly, std::move(known));
}

}  // namespace symkin::declared
