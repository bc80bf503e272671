// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "symkin/model/lanes.hpp"

namespace symkin {

// A value with its derivatives in N directions (forward automatic differentiation), T a double or a
// batch. Operations with a plain T take it as a constant. Like ceres::Jet, but without Eigen's
// expressions, which take the compiler longer and the batches through memory.
template <typename T, int N>
struct Dual {
  T a;
  std::array<T, N> v;

  Dual() = default;
  explicit Dual(const T& value) : a(value) { v.fill(T(0.0)); }
  Dual(const T& value, int direction) : Dual(value) {
    v[static_cast<std::size_t>(direction)] = T(1.0);
  }

  // The value with the derivatives that f gives for the direction i.
  template <typename Derivative>
  static Dual of(const T& value, const Derivative& f) {
    Dual result;
    result.a = value;
    for (std::size_t i = 0; i < N; ++i) {
      result.v[i] = f(i);
    }
    return result;
  }

  friend Dual operator-(const Dual& x) {
    return of(-x.a, [&](std::size_t i) { return -x.v[i]; });
  }
  friend Dual operator+(const Dual& x, const Dual& y) {
    return of(x.a + y.a, [&](std::size_t i) { return x.v[i] + y.v[i]; });
  }
  friend Dual operator+(const Dual& x, const T& y) {
    return of(x.a + y, [&](std::size_t i) { return x.v[i]; });
  }
  friend Dual operator+(const T& x, const Dual& y) { return y + x; }
  friend Dual operator-(const Dual& x, const Dual& y) {
    return of(x.a - y.a, [&](std::size_t i) { return x.v[i] - y.v[i]; });
  }
  friend Dual operator-(const Dual& x, const T& y) {
    return of(x.a - y, [&](std::size_t i) { return x.v[i]; });
  }
  friend Dual operator-(const T& x, const Dual& y) {
    return of(x - y.a, [&](std::size_t i) { return -y.v[i]; });
  }
  friend Dual operator*(const Dual& x, const Dual& y) {
    return of(x.a * y.a, [&](std::size_t i) { return x.a * y.v[i] + x.v[i] * y.a; });
  }
  friend Dual operator*(const Dual& x, const T& y) {
    return of(x.a * y, [&](std::size_t i) { return x.v[i] * y; });
  }
  friend Dual operator*(const T& x, const Dual& y) { return y * x; }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const T inverse = T(1.0) / y.a;
    const T quotient = x.a * inverse;
    return of(quotient, [&](std::size_t i) { return (x.v[i] - quotient * y.v[i]) * inverse; });
  }
  friend Dual operator/(const Dual& x, const T& y) { return x * (T(1.0) / y); }
  friend Dual operator/(const T& x, const Dual& y) {
    const T inverse = T(1.0) / y.a;
    const T quotient = x * inverse;
    return of(quotient, [&](std::size_t i) { return -quotient * inverse * y.v[i]; });
  }

  friend Dual sqrt(const Dual& x) {
    using std::sqrt;
    const T root = sqrt(x.a);
    const T half_inverse = T(0.5) / root;
    return of(root, [&](std::size_t i) { return half_inverse * x.v[i]; });
  }
  friend Dual atan2(const Dual& y, const Dual& x) {
    using std::atan2;
    const T inverse = 1.0 / (x.a * x.a + y.a * y.a);
    return of(atan2(y.a, x.a),
              [&](std::size_t i) { return inverse * (x.a * y.v[i] - y.a * x.v[i]); });
  }
  friend Dual cos(const Dual& x) { return cosine_and_sine(x)[0]; }
  friend Dual sin(const Dual& x) { return cosine_and_sine(x)[1]; }

 private:
  static std::array<Dual, 2> cosine_and_sine(const Dual& x) {
    Dual cosine, sine;
    Lanes<Dual>::cosine_sine(x, cosine, sine);
    return {cosine, sine};
  }
};

template <typename T, int N>
struct Lanes<Dual<T, N>> {
  static void cosine_sine(const Dual<T, N>& x, Dual<T, N>& cosine, Dual<T, N>& sine) {
    T c, s;
    Lanes<T>::cosine_sine(x.a, c, s);
    cosine = Dual<T, N>::of(c, [&](std::size_t i) { return -s * x.v[i]; });
    sine = Dual<T, N>::of(s, [&](std::size_t i) { return c * x.v[i]; });
  }
};

}  // namespace symkin
