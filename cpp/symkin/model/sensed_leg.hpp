// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include "symkin/model/chain_info.hpp"
#include "symkin/model/jet.hpp"
#include "symkin/model/leg_geometry.hpp"
#include "symkin/model/pose.hpp"
#include "symkin/model/sensor.hpp"

namespace symkin {

// What a leg struct does not say itself: derivatives by autodiff of its closure, and the sensor.
// A leg struct (see chains/rrr.hpp) gives
//   kParameterInfos, Geometry<T>          names and roles of its geometry's parameters, and their
//                                         tuple of lengths (T) and angles (Azimuth<T>): LegGeometry
//   kGeometry, kClosures                  how many parameters and closures; see LegGeometry
//   Pose<T>                               the type of its poses
//   kName, kActiveJoint                   and what q measures
//   kModeIsOrientation, kWorkingMode      whether a reflection flips the working mode; its meaning
//   closure<G>(geometry, pose, q)         metres; of k > 1 closures an std::array of k, the first
//                                         of which depends on q
//   root(geometry, pose, mode)            the q that closes the leg, NaN out of reach
//   reach_margin(geometry, pose)          metres inside the reach
//   joint_centres(geometry, pose, q)      for drawings
// The scalars are doubles, batches of them, or jets; q is an Azimuth where the joint is angular.
template <typename Leg, typename SensorType = LinearSensor>
struct SensedLeg {
  using Sensor = SensorType;
  static constexpr int kGeometry = Leg::kGeometry;
  static constexpr int kParameters = kGeometry + Sensor::kParameters;
  static constexpr int kClosures = Leg::kClosures;
  static constexpr bool kAngular = is_angle(Leg::kActiveJoint);
  using Pose = typename Leg::template Pose<double>;
  static constexpr int kDof = Pose::kDof;
  static constexpr int kCoordinates = Pose::kCoordinates;
  template <typename T>
  using Geometry = typename Leg::template Geometry<T>;

  // Derivative directions: geometry, then the pose's tangent, then q.
  static constexpr int kDirections = kGeometry + kDof + 1;
  template <typename T>
  using Full = Jet<T, kDirections>;

  static ChainInfo info() {
    ChainInfo info{
        Leg::kName,        Pose::kSpace, {Leg::kParameterInfos.begin(), Leg::kParameterInfos.end()},
        Leg::kActiveJoint, kClosures,    Leg::kModeIsOrientation,
        Leg::kWorkingMode};
    info.parameters.insert(info.parameters.end(), Sensor::kParameterInfos.begin(),
                           Sensor::kParameterInfos.end());
    return info;
  }

  static Sensor sensor(const double* parameters) { return Sensor(parameters + kGeometry); }

  template <typename T, typename Value>
  static Geometry<T> geometry(const Value* parameters) {
    return make_geometry<Geometry<T>>([=](int i) { return T(parameters[i]); }, Indices());
  }

  // The same as the jet's directions, from its first, those of the parameters from `first` on, as
  // many as it has; the others are constants.
  template <typename J, typename Value>
  static Geometry<J> variable_geometry(const Value* parameters, int first) {
    using T = typename J::Scalar;
    const auto jet = [=](int i) {
      const T value(parameters[i]);
      const int direction = i - first;
      return direction >= 0 && direction < J::DIMENSION ? J(value, direction) : J(value);
    };
    return make_geometry<Geometry<J>>(jet, Indices());
  }

  // q as a closure takes it, and back.
  template <typename T>
  static auto joint(const T& q) {
    if constexpr (kAngular) {
      return Azimuth<T>(q);
    } else {
      return q;
    }
  }

  template <typename Joint>
  static auto variable(const Joint& joint) {
    if constexpr (kAngular) {
      return angle(joint);
    } else {
      return joint;
    }
  }

  // One or more, an array in any case.
  template <typename G, typename T, typename Q>
  static auto closures(const Geometry<G>& geometry, const T& pose, const Q& joint) {
    if constexpr (kClosures == 1) {
      const auto h = Leg::template closure<G>(geometry, pose, joint);
      return std::array<std::decay_t<decltype(h)>, 1>{{h}};
    } else {
      return Leg::template closure<G>(geometry, pose, joint);
    }
  }

  // dh/dparam from the autodiff result: the sensor's parameters act through q.
  template <typename T>
  static std::array<T, kParameters> parameter_derivatives(const Full<T>& h, const Sensor& sensor,
                                                          const T& reading) {
    std::array<T, kParameters> derivatives;
    for (Index i = 0; i < kGeometry; ++i) {
      derivatives[static_cast<std::size_t>(i)] = h.v[i];
    }
    const auto by_sensor = sensor.by_parameters(reading);
    for (std::size_t i = 0; i < by_sensor.size(); ++i) {
      derivatives[kGeometry + i] = by_sensor[i] * h.v[kDirections - 1];
    }
    return derivatives;
  }

 private:
  using Indices = std::make_integer_sequence<int, kGeometry>;

  // Each element from its value: a length as it is, an azimuth with cosine and sine.
  template <typename Tuple, typename Value, int... kIndices>
  static Tuple make_geometry(const Value& value,
                             std::integer_sequence<int, kIndices...> /*indices*/) {
    return Tuple(std::tuple_element_t<kIndices, Tuple>(value(kIndices))...);
  }
};

}  // namespace symkin
