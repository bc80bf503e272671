// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/jet.h>
#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "symkin/model/leg_geometry.hpp"
#include "symkin/model/leg_model.hpp"
#include "symkin/model/sensor.hpp"

namespace symkin {

// Everything that a leg struct does not say itself: batches, derivatives by autodiff of its
// closure, the sensor, cost functions. A leg struct (see chains/rrr.hpp) gives
//   kParameterInfos, Geometry<T>          names and roles of its geometry's parameters, and their
//                                         tuple of lengths (T) and angles (Azimuth<T>): LegGeometry
//   kGeometry, kClosures                  how many parameters and closures; see LegGeometry
//   Pose<T>                               the type of its poses
//   kName, kActiveJoint                   and what q measures
//   kModeIsOrientation, kWorkingMode      whether a reflection flips the working mode; its meaning
//   closure<T>(geometry, pose, q)         metres; of k > 1 closures an std::array<T, k>, the first
//   of
//                                         which depends on q
//   root(geometry, pose, mode)            the closed-form root in q, NaN out of reach
//   reach_margin(geometry, pose)          metres inside the reach
//   joint_centres(geometry, pose, q)      for drawings
// SensedLeg is one with a sensor.
template <typename Leg, typename SensorType = LinearSensor>
struct SensedLeg {
  using Sensor = SensorType;
  static constexpr int kGeometry = Leg::kGeometry;
  static constexpr int kParameters = kGeometry + Sensor::kParameters;
  static constexpr int kClosures = Leg::kClosures;
  static constexpr bool kAngular = is_angle(Leg::kActiveJoint);
  using Pose = typename Leg::template Pose<double>;
  static constexpr int kDof = Pose::kDof;
  using GeometryValues = typename Leg::template Geometry<double>;

  // Derivative directions: geometry, then the pose's tangent, then q.
  static constexpr int kDirections = kGeometry + kDof + 1;
  using FullJet = ceres::Jet<double, kDirections>;
  using FullGeometry = typename Leg::template Geometry<FullJet>;

  static ChainInfo info() {
    ChainInfo info{
        Leg::kName,        Pose::kSpace, {Leg::kParameterInfos.begin(), Leg::kParameterInfos.end()},
        Leg::kActiveJoint, kClosures,    Leg::kModeIsOrientation,
        Leg::kWorkingMode};
    info.parameters.insert(info.parameters.end(), Sensor::kParameterInfos.begin(),
                           Sensor::kParameterInfos.end());
    return info;
  }

  static GeometryValues geometry(const double* parameters) {
    return make_geometry<GeometryValues>([=](int i) { return parameters[i]; }, Indices());
  }

  static Sensor sensor(const double* parameters) { return Sensor(parameters + kGeometry); }

  // psi at the pose, NaN out of reach.
  static double reading(const GeometryValues& geometry, const Sensor& sensor, int mode,
                        const double* pose) {
    return sensor.reading(Leg::root(geometry, Pose::constant(pose), mode), kAngular);
  }

  static FullGeometry variable_geometry(const double* parameters) {
    return make_geometry<FullGeometry>([=](int i) { return FullJet(parameters[i], i); }, Indices());
  }

  template <typename T>
  static typename Leg::template Geometry<T> constant_geometry(const double* parameters) {
    return make_geometry<typename Leg::template Geometry<T>>(
        [=](int i) { return T(parameters[i]); }, Indices());
  }

  // One or more, an array in any case.
  template <typename T>
  static std::array<T, kClosures> closures(const typename Leg::template Geometry<T>& geometry,
                                           const typename Leg::template Pose<T>& pose, const T& q) {
    if constexpr (kClosures == 1) {
      return {{Leg::closure(geometry, pose, q)}};
    } else {
      return Leg::closure(geometry, pose, q);
    }
  }

  static std::array<FullJet, kClosures> full_closures(const FullGeometry& geometry,
                                                      const double* pose, double q) {
    return closures<FullJet>(geometry, Leg::template Pose<FullJet>::variable(pose, kGeometry),
                             FullJet(q, kDirections - 1));
  }

  // dh/dparam from the autodiff result: the sensor's parameters act through q.
  static void parameter_derivatives(const FullJet& h, const Sensor& sensor, double reading,
                                    double* derivatives) {
    std::copy(h.v.data(), h.v.data() + kGeometry, derivatives);
    const auto by_sensor = sensor.by_parameters(reading);
    for (int i = 0; i < Sensor::kParameters; ++i) {
      derivatives[kGeometry + i] = by_sensor[static_cast<std::size_t>(i)] * h.v[kDirections - 1];
    }
  }

 private:
  using Indices = std::make_integer_sequence<int, kGeometry>;

  // Each element from its value: a length as it is, an azimuth with cosine and sine.
  template <typename Geometry, typename Value, int... kIndices>
  static Geometry make_geometry(const Value& value,
                                std::integer_sequence<int, kIndices...> /*indices*/) {
    return Geometry(std::tuple_element_t<kIndices, Geometry>(value(kIndices))...);
  }
};

// Residuals h(parameters; pose, reading) of one measured pose, metres, one a closure. Weights and
// losses wrap it.
template <typename Leg, typename Sensor = LinearSensor>
class ClosureCost final
    : public ceres::SizedCostFunction<Leg::kClosures, SensedLeg<Leg, Sensor>::kParameters> {
  using Sensed = SensedLeg<Leg, Sensor>;

 public:
  ClosureCost(const double* pose, double reading) : reading_(reading) {
    std::copy(pose, pose + Sensed::Pose::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const Sensor sensor = Sensed::sensor(values);
    const auto all = Sensed::full_closures(Sensed::variable_geometry(values), pose_.data(),
                                           sensor.active_joint(reading_));
    for (int c = 0; c < Sensed::kClosures; ++c) {
      const auto& h = all[static_cast<std::size_t>(c)];
      residuals[c] = h.a;
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        Sensed::parameter_derivatives(h, sensor, reading_, jacobians[0] + c * Sensed::kParameters);
      }
    }
    return true;
  }

 private:
  std::array<double, Sensed::Pose::kCoordinates> pose_;
  double reading_;
};

// Residual g(parameters; pose) - reading of one measured pose (Eq. 15), sensor units, angles
// compared by the shortest turn. Derivative by the implicit function theorem, of the closure that
// depends on q.
template <typename Leg, typename Sensor = LinearSensor>
class ReadingCost final : public ceres::SizedCostFunction<1, SensedLeg<Leg, Sensor>::kParameters> {
  using Sensed = SensedLeg<Leg, Sensor>;

 public:
  ReadingCost(int mode, const double* pose, double reading) : mode_(mode), reading_(reading) {
    std::copy(pose, pose + Sensed::Pose::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const Sensor sensor = Sensed::sensor(values);
    const double root = Sensed::reading(Sensed::geometry(values), sensor, mode_, pose_.data());
    residuals[0] = sensor.difference(root, reading_, Sensed::kAngular);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      // On the turn on which the sensor stands.
      const double reading = reading_ + residuals[0];
      const auto h = Sensed::full_closures(Sensed::variable_geometry(values), pose_.data(),
                                           sensor.active_joint(reading))
                         .front();
      Sensed::parameter_derivatives(h, sensor, reading, jacobians[0]);
      const double by_reading = sensor.by_reading(reading) * h.v[Sensed::kDirections - 1];
      for (int i = 0; i < Sensed::kParameters; ++i) {
        jacobians[0][i] /= -by_reading;
      }
    }
    return std::isfinite(residuals[0]);
  }

 private:
  std::array<double, Sensed::Pose::kCoordinates> pose_;
  int mode_;
  double reading_;
};

// The batched loops are flattened, everything that they call inlined: the arithmetic of small
// autodiff scalars costs less than passing them through memory. With the checks of the sanitizers
// that would be too much for the compiler.
#ifdef __SANITIZE_ADDRESS__
#define SYMKIN_FLATTEN
#else
#define SYMKIN_FLATTEN [[gnu::flatten]]
#endif
template <typename Leg, typename Sensor = LinearSensor>
class LegModelOf final : public LegModel {
  using Sensed = SensedLeg<Leg, Sensor>;
  using Pose = typename Sensed::Pose;
  using Costs = std::vector<std::unique_ptr<ceres::CostFunction>>;
  static constexpr int kClosures = Sensed::kClosures;

 public:
  LegModelOf() : info_(Sensed::info()) {}

  const ChainInfo& info() const override { return info_; }

  SYMKIN_FLATTEN void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                                         Eigen::Ref<Vector> readings) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    const Sensor sensor = Sensed::sensor(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      readings[i] = Sensed::reading(geometry, sensor, working_mode, poses.row(i).data());
    }
  }

  SYMKIN_FLATTEN void reach_margin(ConstVector parameters, ConstRows poses,
                                   Eigen::Ref<Vector> margins) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      margins[i] = Leg::reach_margin(geometry, Pose::constant(poses.row(i).data()));
    }
  }

  void reading_differences(ConstVector parameters, ConstVector readings, ConstVector others,
                           Eigen::Ref<Vector> differences) const override {
    const Sensor sensor = Sensed::sensor(parameters.data());
    for (Index i = 0; i < readings.size(); ++i) {
      differences[i] = sensor.difference(readings[i], others[i], Sensed::kAngular);
    }
  }

  double sensor_gain(ConstVector parameters, double reading) const override {
    return Sensed::sensor(parameters.data()).by_reading(reading);
  }

  SYMKIN_FLATTEN void closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                              Eigen::Ref<Vector> values) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    const Sensor sensor = Sensed::sensor(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      const auto all = Sensed::template closures<double>(
          geometry, Pose::constant(poses.row(i).data()), sensor.active_joint(readings[i]));
      for (int c = 0; c < kClosures; ++c) {
        values[i * kClosures + c] = all[static_cast<std::size_t>(c)];
      }
    }
  }

  SYMKIN_FLATTEN void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                                ClosureRows& rows) const override {
    rows.resize(poses.rows() * kClosures, Sensed::kParameters, Sensed::kDof);
    const auto geometry = Sensed::variable_geometry(parameters.data());
    const Sensor sensor = Sensed::sensor(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      const double reading = readings[i];
      const auto all =
          Sensed::full_closures(geometry, poses.row(i).data(), sensor.active_joint(reading));
      for (int c = 0; c < kClosures; ++c) {
        const auto& h = all[static_cast<std::size_t>(c)];
        const Index row = i * kClosures + c;
        rows.closure[row] = h.a;
        Sensed::parameter_derivatives(h, sensor, reading, rows.by_parameters.row(row).data());
        rows.by_pose.row(row) = h.v.template segment<Sensed::kDof>(Sensed::kGeometry);
        rows.by_reading[row] = sensor.by_reading(reading) * h.v[Sensed::kDirections - 1];
      }
    }
  }

  SYMKIN_FLATTEN void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                                     ClosureRows& rows) const override {
    using PoseJet = ceres::Jet<double, Sensed::kDof + 1>;
    rows.closure.resize(poses.rows() * kClosures);
    rows.by_pose.resize(poses.rows() * kClosures, Sensed::kDof);
    rows.by_reading.resize(poses.rows() * kClosures);
    const auto geometry = Sensed::template constant_geometry<PoseJet>(parameters.data());
    const Sensor sensor = Sensed::sensor(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      const double reading = readings[i];
      const auto all = Sensed::template closures<PoseJet>(
          geometry, Leg::template Pose<PoseJet>::variable(poses.row(i).data(), 0),
          PoseJet(sensor.active_joint(reading), Sensed::kDof));
      for (int c = 0; c < kClosures; ++c) {
        const PoseJet& h = all[static_cast<std::size_t>(c)];
        const Index row = i * kClosures + c;
        rows.closure[row] = h.a;
        rows.by_pose.row(row) = h.v.template head<Sensed::kDof>();
        rows.by_reading[row] = sensor.by_reading(reading) * h.v[Sensed::kDof];
      }
    }
  }

  Costs closure_costs(ConstRows poses, ConstVector readings) const override {
    Costs costs;
    for (Index i = 0; i < poses.rows(); ++i) {
      costs.push_back(std::make_unique<ClosureCost<Leg, Sensor>>(poses.row(i).data(), readings[i]));
    }
    return costs;
  }

  Costs reading_costs(int working_mode, ConstRows poses, ConstVector readings) const override {
    Costs costs;
    for (Index i = 0; i < poses.rows(); ++i) {
      costs.push_back(std::make_unique<ReadingCost<Leg, Sensor>>(working_mode, poses.row(i).data(),
                                                                 readings[i]));
    }
    return costs;
  }

  RowMatrix joint_centres(ConstVector parameters, ConstVector pose, double reading) const override {
    const auto joints =
        Leg::joint_centres(Sensed::geometry(parameters.data()), Pose::constant(pose.data()),
                           Sensed::sensor(parameters.data()).active_joint(reading));
    RowMatrix centres(static_cast<Index>(joints.size()), position_size(Pose::kSpace));
    for (std::size_t i = 0; i < joints.size(); ++i) {
      centres.row(static_cast<Index>(i)) = joints[i].transpose();
    }
    return centres;
  }

 private:
  ChainInfo info_;
};

#undef SYMKIN_FLATTEN

}  // namespace symkin
