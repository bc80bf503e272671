// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "symkin/model/chain_model.hpp"
#include "symkin/model/leg_kernels_of.hpp"
#include "symkin/model/sensed_leg.hpp"

namespace symkin {

// The model of a leg struct with its sensor.
template <typename Leg, typename Sensor = LinearSensor>
class LegModelOf final : public KernelModel {
  using Sensed = SensedLeg<Leg, Sensor>;

 public:
  // Other kernels than those on one pose at a time are for what is compiled for several processors.
  explicit LegModelOf(const LegKernels& kernels = leg_kernels<Leg, Sensor, double>())
      : KernelModel(Sensed::info(), kernels) {}

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
