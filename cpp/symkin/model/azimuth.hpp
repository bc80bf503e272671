// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/model/lanes.hpp"

namespace symkin {

// An angle with its cosine and sine, for angles that many poses share or that are added up: the
// trigonometric functions are what a closure spends its time on.
template <typename T>
struct Azimuth {
  Azimuth() = default;
  explicit Azimuth(const T& value) : angle(value) { Lanes<T>::cosine_sine(value, cosine, sine); }
  Azimuth(const T& value, const T& cosine_of_it, const T& sine_of_it)
      : angle(value), cosine(cosine_of_it), sine(sine_of_it) {}

  static Azimuth zero() { return {T(0.0), T(1.0), T(0.0)}; }

  T angle, cosine, sine;
};

template <typename A, typename B>
auto operator+(const Azimuth<A>& a, const Azimuth<B>& b) {
  return Azimuth<decltype(a.angle + b.angle)>(a.angle + b.angle,
                                              a.cosine * b.cosine - a.sine * b.sine,
                                              a.sine * b.cosine + a.cosine * b.sine);
}

}  // namespace symkin
