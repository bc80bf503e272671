// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/jet.h>

#include "symkin/model/lanes.hpp"

namespace symkin {

// The closures are differentiated by Ceres' jets, a value with its derivatives in N directions, of
// which T is a double or a batch of them (chains/detail/batch_lanes.hpp).
using ceres::Jet;

// The value with the derivatives that f gives for the direction i.
template <typename T, int N, typename Derivative>
Jet<T, N> jet_of(const T& value, const Derivative& f) {
  Jet<T, N> jet(value);
  for (int i = 0; i < N; ++i) {
    jet.v[i] = f(i);
  }
  return jet;
}

// Cosine and sine have one evaluation of both, which for batches depends on no neighbour.
template <typename T, int N>
struct Lanes<Jet<T, N>> {
  static void cosine_sine(const Jet<T, N>& x, Jet<T, N>& cosine, Jet<T, N>& sine) {
    T c, s;
    Lanes<T>::cosine_sine(x.a, c, s);
    cosine = Jet<T, N>(c, -s * x.v);
    sine = Jet<T, N>(s, c * x.v);
  }
};

}  // namespace symkin
