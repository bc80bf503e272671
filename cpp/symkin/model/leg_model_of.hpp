// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "symkin/model/leg_kernels_of.hpp"
#include "symkin/model/leg_model.hpp"
#include "symkin/model/sensed_leg.hpp"

namespace symkin {

// Residuals h(parameters; pose, reading) of one measured pose, metres, one a closure. Weights and
// losses wrap it.
template <typename Leg, typename Sensor = LinearSensor>
class ClosureCost final
    : public ceres::SizedCostFunction<Leg::kClosures, SensedLeg<Leg, Sensor>::kParameters> {
  using Sensed = SensedLeg<Leg, Sensor>;

 public:
  ClosureCost(const double* pose, double reading) : reading_(reading) {
    std::copy(pose, pose + Sensed::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const Sensor sensor = Sensed::sensor(values);
    const auto all = Sensed::full_closures(Sensed::template variable_geometry<double>(values),
                                           pose_.data(), sensor.active_joint(reading_));
    for (int c = 0; c < Sensed::kClosures; ++c) {
      const auto& h = all[static_cast<std::size_t>(c)];
      residuals[c] = h.a;
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        const auto gradient = Sensed::parameter_derivatives(h, sensor, reading_);
        std::copy(gradient.begin(), gradient.end(), jacobians[0] + c * Sensed::kParameters);
      }
    }
    return true;
  }

 private:
  std::array<double, Sensed::kCoordinates> pose_;
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
    std::copy(pose, pose + Sensed::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const Sensor sensor = Sensed::sensor(values);
    const double q = Sensed::variable(Leg::root(Sensed::template geometry<double>(values),
                                                Sensed::Pose::constant(pose_.data()),
                                                static_cast<double>(mode_)));
    residuals[0] =
        sensor.difference(sensor.reading(q, Sensed::kAngular), reading_, Sensed::kAngular);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      // On the turn on which the sensor stands.
      const double reading = reading_ + residuals[0];
      const auto h = Sensed::full_closures(Sensed::template variable_geometry<double>(values),
                                           pose_.data(), sensor.active_joint(reading))
                         .front();
      const auto gradient = Sensed::parameter_derivatives(h, sensor, reading);
      const double by_reading = sensor.by_reading(reading) * h.v[Sensed::kDirections - 1];
      for (std::size_t i = 0; i < gradient.size(); ++i) {
        jacobians[0][i] = -gradient[i] / by_reading;
      }
    }
    return std::isfinite(residuals[0]);
  }

 private:
  std::array<double, Sensed::kCoordinates> pose_;
  int mode_;
  double reading_;
};

// The model of a leg struct with its sensor.
template <typename Leg, typename Sensor = LinearSensor>
class LegModelOf final : public LegModel {
  using Sensed = SensedLeg<Leg, Sensor>;
  using Costs = std::vector<std::unique_ptr<ceres::CostFunction>>;

 public:
  // Other kernels than those on one pose at a time are for what is compiled for several processors.
  explicit LegModelOf(const LegKernels& kernels = leg_kernels<Leg, Sensor, double>())
      : LegModel(Sensed::info(), kernels) {}

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
    const auto joints = Leg::joint_centres(
        Sensed::template geometry<double>(parameters.data()), Sensed::Pose::constant(pose.data()),
        Sensed::joint(Sensed::sensor(parameters.data()).active_joint(reading)));
    RowMatrix centres(static_cast<Index>(joints.size()), joints.front().size());
    for (std::size_t i = 0; i < joints.size(); ++i) {
      centres.row(static_cast<Index>(i)) = joints[i].transpose();
    }
    return centres;
  }
};

}  // namespace symkin
