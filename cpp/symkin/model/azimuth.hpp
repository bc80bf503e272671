// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

namespace symkin {

// An angle with its cosine and sine, for angles that many poses share or that are added up: the
// trigonometric functions are what a closure spends its time on.
template <typename T>
struct Azimuth {
  Azimuth() = default;
  explicit Azimuth(const T& value) : angle(value) {
    using std::cos;
    using std::sin;
    cosine = cos(value);
    sine = sin(value);
  }

  static Azimuth zero() { return {T(0.0), T(1.0), T(0.0)}; }

  friend Azimuth operator+(const Azimuth& a, const Azimuth& b) {
    return {a.angle + b.angle, a.cosine * b.cosine - a.sine * b.sine,
            a.sine * b.cosine + a.cosine * b.sine};
  }

  T angle, cosine, sine;

 private:
  Azimuth(const T& value, const T& cosine_of_it, const T& sine_of_it)
      : angle(value), cosine(cosine_of_it), sine(sine_of_it) {}
};

}  // namespace symkin
