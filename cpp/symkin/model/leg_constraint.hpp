// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/autodiff_cost_function.h>

#include <array>
#include <cstddef>

#include "symkin/model/sensed_leg.hpp"

namespace symkin {

// A leg as a functor for problems of your own in Ceres. Residuals: its closures h(parameters, pose,
// psi), metres, zero where the leg closes; theory.md, section 2, has them chain by chain. Blocks:
//   parameters  kParameters   the leg's, then the sensor's, as info().parameters names them
//   pose        kCoordinates  one row of poses; see pose_manifold() where it holds a quaternion
//   reading     1             psi
// Nothing is weighted: wrap it, as cpp/examples/04_two_robots.cpp does. Where the chain is known at
// run time alone, LegModel::constraint() is the same function.
template <typename Leg, typename Sensor = LinearSensor>
struct LegConstraint {
  using Sensed = SensedLeg<Leg, Sensor>;
  static constexpr int kClosures = Sensed::kClosures;
  static constexpr int kParameters = Sensed::kParameters;
  static constexpr int kCoordinates = Sensed::kCoordinates;
  using CostFunction =
      ceres::AutoDiffCostFunction<LegConstraint, kClosures, kParameters, kCoordinates, 1>;

  static CostFunction* create() { return new CostFunction(new LegConstraint); }

  template <typename T>
  bool operator()(const T* parameters, const T* pose, const T* reading, T* closures) const {
    const auto all = Sensed::template closures<T>(
        Sensed::template geometry<T>(parameters), Leg::template Pose<T>::constant(pose),
        Sensed::joint(active_joint(parameters + Sensed::kGeometry, *reading)));
    for (std::size_t i = 0; i < all.size(); ++i) {
      closures[i] = all[i];
    }
    return true;
  }

 private:
  static double active_joint(const double* parameters, double reading) {
    return Sensor(parameters).active_joint(reading);
  }

  // A sensor states its law and derivatives for plain readings.
  template <int N>
  static Jet<double, N> active_joint(const Jet<double, N>* parameters,
                                     const Jet<double, N>& reading) {
    std::array<double, Sensor::kParameters> values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = parameters[i].a;
    }
    const Sensor sensor(values.data());
    Jet<double, N> q(sensor.active_joint(reading.a), sensor.by_reading(reading.a) * reading.v);
    const auto by_parameters = sensor.by_parameters(reading.a);
    for (std::size_t i = 0; i < values.size(); ++i) {
      q.v += by_parameters[i] * parameters[i].v;
    }
    return q;
  }
};

}  // namespace symkin
