// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "symkin/model/sensed_leg.hpp"

namespace symkin::detail {

// The closures of one leg with all derivatives: by geometry, by the pose's tangent, by q. Jets of
// so many directions that they no longer fit the registers cost more than evaluating the closures
// again: beyond sixteen a few directions are taken at a time.
template <typename Leg, typename Sensor, typename T>
class ClosureJets {
  using Sensed = SensedLeg<Leg, Sensor>;
  using Full = typename Sensed::template Full<T>;
  static constexpr int kGeometry = Sensed::kGeometry;
  static constexpr int kClosures = Sensed::kClosures;
  static constexpr bool kAtOnce = Sensed::kDirections <= 16;
  static constexpr int kWidth = kAtOnce ? Sensed::kDirections : 6;
  static constexpr int kParts = kAtOnce ? 1 : (kGeometry + kWidth - 1) / kWidth;
  using Part = Jet<T, kWidth>;

 public:
  using Closures = std::array<Full, static_cast<std::size_t>(kClosures)>;

  // Of one leg, or of a leg a lane.
  template <typename Value>
  explicit ClosureJets(const Value* parameters)
      : constant_(Sensed::template geometry<T>(parameters)) {
    for (int part = 0; part < kParts; ++part) {
      parts_[static_cast<std::size_t>(part)] =
          Sensed::template variable_geometry<Part>(parameters, part * kWidth);
    }
  }

  Closures operator()(const T* pose, const T& q) const {
    if constexpr (kAtOnce) {
      return Sensed::template closures<Full>(parts_[0],
                                             Leg::template Pose<Full>::variable(pose, kGeometry),
                                             Sensed::joint(Full(q, Sensed::kDirections - 1)));
    } else {
      return in_turn(pose, q);
    }
  }

 private:
  Closures in_turn(const T* pose, const T& q) const {
    constexpr int kRest = Sensed::kDof + 1;
    using Rest = Jet<T, kRest>;
    Closures all;
    take(Sensed::template closures<T>(constant_, Leg::template Pose<Rest>::variable(pose, 0),
                                      Sensed::joint(Rest(q, kRest - 1))),
         kGeometry, all);
    const auto fixed_pose = Leg::template Pose<T>::constant(pose);
    const auto fixed_joint = Sensed::joint(q);
    for (int part = 0; part < kParts; ++part) {
      take(Sensed::template closures<Part>(parts_[static_cast<std::size_t>(part)], fixed_pose,
                                           fixed_joint),
           part * kWidth, all);
    }
    return all;
  }

  // What the jets of a part say, whose directions stand from `first` on among all.
  template <typename Jets>
  static void take(const Jets& jets, int first, Closures& all) {
    for (std::size_t c = 0; c < all.size(); ++c) {
      all[c].a = jets[c].a;
      const int end = first < kGeometry ? kGeometry : Sensed::kDirections;
      for (int i = 0; i < jets[c].v.size() && first + i < end; ++i) {
        all[c].v[first + i] = jets[c].v[i];
      }
    }
  }

  typename Sensed::template Geometry<T> constant_;
  std::array<typename Sensed::template Geometry<Part>, static_cast<std::size_t>(kParts)> parts_;
};

}  // namespace symkin::detail
