// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "symkin/model/lanes.hpp"

namespace symkin {

// A value with its derivatives in N directions (forward automatic differentiation), T a double or a
// batch. Operations with a plain T take it as a constant. Like ceres::Jet, but without Eigen's
// expressions, which take the compiler longer and the batches through memory.
// At first most directions have no derivative: a parameter has one. The compiler sees these zeros,
// since nothing here is a loop, and leaves out what only they go into. Finite results are the same.
template <typename T, int N>
struct Dual {
  T a;
  std::array<T, N> v;

  Dual() = default;
  explicit Dual(const T& value)
      : Dual(of(value, [](std::size_t /*direction*/) { return T(0.0); })) {}
  Dual(const T& value, int direction) : Dual(value) {
    v[static_cast<std::size_t>(direction)] = T(1.0);
  }

  // The value with the derivatives that f gives for the direction i.
  template <typename Derivative>
  static Dual of(const T& value, const Derivative& f) {
    return of(value, f, std::make_index_sequence<N>());
  }

  friend Dual operator-(const Dual& x) {
    return of(-x.a, [&](std::size_t i) { return -x.v[i]; });
  }
  friend Dual operator+(const Dual& x, const Dual& y) {
    return of(x.a + y.a, [&](std::size_t i) { return sum(x.v[i], y.v[i]); });
  }
  friend Dual operator+(const Dual& x, const T& y) {
    return of(x.a + y, [&](std::size_t i) { return x.v[i]; });
  }
  friend Dual operator+(const T& x, const Dual& y) { return y + x; }
  friend Dual operator-(const Dual& x, const Dual& y) {
    return of(x.a - y.a, [&](std::size_t i) { return difference(x.v[i], y.v[i]); });
  }
  friend Dual operator-(const Dual& x, const T& y) {
    return of(x.a - y, [&](std::size_t i) { return x.v[i]; });
  }
  friend Dual operator-(const T& x, const Dual& y) {
    return of(x - y.a, [&](std::size_t i) { return -y.v[i]; });
  }
  friend Dual operator*(const Dual& x, const Dual& y) {
    return of(x.a * y.a,
              [&](std::size_t i) { return sum(product(x.a, y.v[i]), product(y.a, x.v[i])); });
  }
  friend Dual operator*(const Dual& x, const T& y) {
    return of(x.a * y, [&](std::size_t i) { return product(y, x.v[i]); });
  }
  friend Dual operator*(const T& x, const Dual& y) { return y * x; }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const T inverse = T(1.0) / y.a;
    const T quotient = x.a * inverse;
    return of(quotient, [&](std::size_t i) {
      return product(inverse, difference(x.v[i], product(quotient, y.v[i])));
    });
  }
  friend Dual operator/(const Dual& x, const T& y) { return x * (T(1.0) / y); }
  friend Dual operator/(const T& x, const Dual& y) {
    const T inverse = T(1.0) / y.a;
    const T quotient = x * inverse;
    return of(quotient, [&](std::size_t i) { return product(-quotient * inverse, y.v[i]); });
  }

  friend Dual sqrt(const Dual& x) {
    using std::sqrt;
    const T root = sqrt(x.a);
    const T half_inverse = T(0.5) / root;
    return of(root, [&](std::size_t i) { return product(half_inverse, x.v[i]); });
  }
  friend Dual atan2(const Dual& y, const Dual& x) {
    using std::atan2;
    const T inverse = 1.0 / (x.a * x.a + y.a * y.a);
    return of(atan2(y.a, x.a), [&](std::size_t i) {
      return product(inverse, difference(product(x.a, y.v[i]), product(y.a, x.v[i])));
    });
  }
  friend Dual cos(const Dual& x) { return cosine_and_sine(x)[0]; }
  friend Dual sin(const Dual& x) { return cosine_and_sine(x)[1]; }

  // Of derivatives.
  static T sum(const T& x, const T& y) {
    return Lanes<T>::known_zero(y) ? x : Lanes<T>::known_zero(x) ? y : x + y;
  }
  static T difference(const T& x, const T& y) {
    return Lanes<T>::known_zero(y) ? x : Lanes<T>::known_zero(x) ? -y : x - y;
  }
  static T product(const T& factor, const T& x) { return Lanes<T>::known_zero(x) ? x : factor * x; }

 private:
  template <typename Derivative, std::size_t... kDirections>
  static Dual of(const T& value, const Derivative& f, std::index_sequence<kDirections...> /*all*/) {
    Dual result;
    result.a = value;
    ((result.v[kDirections] = f(kDirections)), ...);
    return result;
  }

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
    using D = Dual<T, N>;
    cosine = D::of(c, [&](std::size_t i) { return D::product(-s, x.v[i]); });
    sine = D::of(s, [&](std::size_t i) { return D::product(c, x.v[i]); });
  }
};

}  // namespace symkin
