// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "symkin/model/lanes.hpp"

namespace symkin {

// An angle as its cosine and sine: the trigonometric functions are what a closure would spend its
// time on, and angles that many poses share, or that are added up, have them only once.
template <typename T>
struct Azimuth {
  Azimuth() = default;
  explicit Azimuth(const T& angle) { Lanes<T>::cosine_sine(angle, cosine, sine); }
  Azimuth(const T& cosine_of_it, const T& sine_of_it) : cosine(cosine_of_it), sine(sine_of_it) {}

  static Azimuth zero() { return {T(1.0), T(0.0)}; }

  T cosine, sine;
};

template <typename A, typename B>
auto operator+(const Azimuth<A>& a, const Azimuth<B>& b) {
  return Azimuth<decltype(a.cosine * b.cosine)>(a.cosine * b.cosine - a.sine * b.sine,
                                                a.sine * b.cosine + a.cosine * b.sine);
}

template <typename A, typename B>
auto operator-(const Azimuth<A>& a, const Azimuth<B>& b) {
  return Azimuth<decltype(a.cosine * b.cosine)>(a.cosine * b.cosine + a.sine * b.sine,
                                                a.sine * b.cosine - a.cosine * b.sine);
}

// Between -pi and pi.
template <typename T>
T angle(const Azimuth<T>& azimuth) {
  using std::atan2;
  return atan2(azimuth.sine, azimuth.cosine);
}

}  // namespace symkin
