// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "symkin/model/closure_jets.hpp"
#include "symkin/model/leg_kernels.hpp"
#include "symkin/model/per_leg.hpp"

// Everything that the loops call is inlined into them: passing jets through memory costs more than
// their arithmetic. With the checks of the sanitizers that would be too much for the compiler.
#ifdef __SANITIZE_ADDRESS__
#define SYMKIN_FLATTEN
#else
#define SYMKIN_FLATTEN [[gnu::flatten]]
#endif

namespace symkin::detail {

// The poses from `first` on that stand side by side in T. Beyond the last pose the lanes repeat it,
// and write the same once more.
template <typename T>
class LaneRows {
 public:
  LaneRows(Index first, Index count) {
    for (int lane = 0; lane < Lanes<T>::kCount; ++lane) {
      rows_[static_cast<std::size_t>(lane)] = std::min(first + lane, count - 1);
    }
  }

  Index row(int lane) const { return rows_[static_cast<std::size_t>(lane)]; }

  T read(const double* column, Index stride) const {
    return Lanes<T>::gather(column, offsets(stride).data());
  }
  void write(const T& value, double* column, Index stride) const {
    Lanes<T>::scatter(value, column, offsets(stride).data());
  }

  template <std::size_t kCount>
  std::array<T, kCount> coordinates(const PoseSpan& poses) const {
    std::array<T, kCount> all;
    for (std::size_t i = 0; i < kCount; ++i) {
      all[i] = read(poses.first + i, poses.stride);
    }
    return all;
  }

 private:
  using Offsets = std::array<Index, Lanes<T>::kCount>;

  Offsets offsets(Index stride) const {
    Offsets offsets = rows_;
    for (Index& offset : offsets) {
      offset *= stride;
    }
    return offsets;
  }

  Offsets rows_;
};

// The kernels of a leg with its sensor for the scalar T, which is a double or a batch of them.
template <typename Leg, typename Sensor, typename T>
class BatchedLeg {
  using Sensed = SensedLeg<Leg, Sensor>;
  using Rows = LaneRows<T>;
  using Pose = typename Leg::template Pose<T>;
  template <typename S>
  using PoseOf = typename Leg::template Pose<S>;
  static constexpr int kClosures = Sensed::kClosures;
  static constexpr int kDof = Pose::kDof;
  static constexpr int kCoordinates = Pose::kCoordinates;

 public:
  using Coordinates = std::array<T, kCoordinates>;

  // A leg's values for all lanes.
  struct Values {
    typename Leg::template Geometry<T> geometry;
    Sensor sensor;
    T mode;
  };

  static Values values(const LegValues& leg) {
    return {Sensed::template geometry<T>(leg.parameters), Sensed::sensor(leg.parameters),
            T(static_cast<double>(leg.working_mode))};
  }

  static Coordinates coordinates(const PoseSpan& poses, const Rows& rows) {
    return rows.template coordinates<kCoordinates>(poses);
  }

  SYMKIN_FLATTEN static void inverse(LegSpan legs, PoseSpan poses, double* readings) {
    const PerLeg<Values> all(legs, values);
    for (Index first = 0; first < poses.count; first += Lanes<T>::kCount) {
      const Rows rows(first, poses.count);
      const Pose pose = Pose::constant(coordinates(poses, rows).data());
      double* column = readings;
      for (const Values& leg : all) {
        const T q = Sensed::variable(Leg::root(leg.geometry, pose, leg.mode));
        rows.write(leg.sensor.reading(q, Sensed::kAngular), column++, legs.count);
      }
    }
  }

  SYMKIN_FLATTEN static void reach(LegSpan legs, PoseSpan poses, double* margins) {
    const PerLeg<Values> all(legs, values);
    for (Index first = 0; first < poses.count; first += Lanes<T>::kCount) {
      const Rows rows(first, poses.count);
      const Pose pose = Pose::constant(coordinates(poses, rows).data());
      double* column = margins;
      for (const Values& leg : all) {
        rows.write(Leg::reach_margin(leg.geometry, pose), column++, legs.count);
      }
    }
  }

  SYMKIN_FLATTEN static void by_pose(LegSpan legs, PoseSpan poses, const double* readings,
                                     double* closures, double* by_pose, double* by_reading) {
    using D = Jet<T, kDof + 1>;
    const PerLeg<Values> all(legs, values);
    const Index columns = legs.count * kClosures;
    for (Index first = 0; first < poses.count; first += Lanes<T>::kCount) {
      const Rows rows(first, poses.count);
      const auto pose = PoseOf<D>::variable(coordinates(poses, rows).data(), 0);
      Index column = 0;
      for (Index leg = 0; leg < legs.count; ++leg) {
        const Values& of_leg = all[static_cast<std::size_t>(leg)];
        const T reading = rows.read(readings + leg, legs.count);
        const D q(of_leg.sensor.active_joint(reading), kDof);
        for (const D& h : Sensed::template closures<T>(of_leg.geometry, pose, Sensed::joint(q))) {
          rows.write(h.a, closures + column, columns);
          for (Index i = 0; i < kDof; ++i) {
            rows.write(h.v[i], by_pose + column * kDof + i, columns * kDof);
          }
          rows.write(of_leg.sensor.by_reading(reading) * h.v[kDof], by_reading + column, columns);
          ++column;
        }
      }
    }
  }

  SYMKIN_FLATTEN static void linearise(const double* parameters, PoseSpan poses,
                                       const double* readings, double* closures,
                                       double* by_parameters, double* by_pose, double* by_reading) {
    constexpr Index kParameters = Sensed::kParameters;
    const ClosureJets<Leg, Sensor, T> closure_jets(parameters);
    const Sensor sensor = Sensed::sensor(parameters);
    for (Index first = 0; first < poses.count; first += Lanes<T>::kCount) {
      const Rows rows(first, poses.count);
      const T reading = rows.read(readings, 1);
      const auto all = closure_jets(coordinates(poses, rows).data(), sensor.active_joint(reading));
      for (Index c = 0; c < kClosures; ++c) {
        const auto& h = all[static_cast<std::size_t>(c)];
        rows.write(h.a, closures + c, kClosures);
        const auto gradient = Sensed::parameter_derivatives(h, sensor, reading);
        for (Index i = 0; i < kParameters; ++i) {
          rows.write(gradient[static_cast<std::size_t>(i)], by_parameters + c * kParameters + i,
                     kClosures * kParameters);
        }
        for (Index i = 0; i < kDof; ++i) {
          rows.write(h.v[Sensed::kGeometry + i], by_pose + c * kDof + i, kClosures * kDof);
        }
        rows.write(sensor.by_reading(reading) * h.v[Sensed::kDirections - 1], by_reading + c,
                   kClosures);
      }
    }
  }

  SYMKIN_FLATTEN static void linearise_lanes(const LegLanes& legs, double* to) {
    constexpr int kLanes = Lanes<T>::kCount;
    constexpr int kParameters = Sensed::kParameters;
    std::array<T, kParameters> parameters;
    std::array<double, kLanes * Sensor::kParameters> sensors;
    std::array<Index, kLanes> lanes;
    for (int i = 0; i < kParameters; ++i) {
      parameters[static_cast<std::size_t>(i)] = Lanes<T>::load(legs.parameters + i * kLanes);
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      lanes[static_cast<std::size_t>(lane)] = lane;
      for (int i = 0; i < Sensor::kParameters; ++i) {
        const Index at = Index{lane} * Sensor::kParameters + i;
        sensors[static_cast<std::size_t>(at)] =
            legs.parameters[(Sensed::kGeometry + i) * kLanes + lane];
      }
    }
    const ClosureJets<Leg, Sensor, T> closure_jets(parameters.data());
    const auto write = [&](const T& value) {
      Lanes<T>::store(value, to);
      to += kLanes;
    };
    // A sensor knows one leg.
    const auto of_sensors = [&](const auto& value) {
      std::array<double, kLanes> each;
      for (int lane = 0; lane < kLanes; ++lane) {
        each[static_cast<std::size_t>(lane)] =
            value(Sensor(sensors.data() + lane * Sensor::kParameters), lane);
      }
      return Lanes<T>::gather(each.data(), lanes.data());
    };
    for (Index k = 0; k < legs.count; ++k) {
      const double* const readings = legs.readings + k * kLanes;
      Coordinates pose;
      for (int i = 0; i < kCoordinates; ++i) {
        pose[static_cast<std::size_t>(i)] =
            Lanes<T>::load(legs.poses + (k * kCoordinates + i) * kLanes);
      }
      const auto all = closure_jets(pose.data(), of_sensors([&](const Sensor& sensor, int lane) {
                                      return sensor.active_joint(readings[lane]);
                                    }));
      for (const auto& h : all) {
        const T& by_joint = h.v[Sensed::kDirections - 1];
        write(h.a);
        for (int i = 0; i < Sensed::kGeometry; ++i) {
          write(h.v[i]);
        }
        for (int i = 0; i < Sensor::kParameters; ++i) {
          write(by_joint * of_sensors([&](const Sensor& sensor, int lane) {
                  return sensor.by_parameters(readings[lane])[static_cast<std::size_t>(i)];
                }));
        }
        for (int i = 0; i < kDof; ++i) {
          write(h.v[Sensed::kGeometry + i]);
        }
        write(by_joint * of_sensors([&](const Sensor& sensor, int lane) {
                return sensor.by_reading(readings[lane]);
              }));
      }
    }
  }
};

}  // namespace symkin::detail
