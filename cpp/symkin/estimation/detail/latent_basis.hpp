// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "symkin/estimation/detail/latent_pack.hpp"

namespace symkin::detail {

// How B, the rows of a pose by its tangent, is taken out of them, kRows rows or any number (0).
// Both ways give E with E'B = 0, and the pose that the rest asks for.

// Of any rows, brought to length one, by Householder's reflections: E is orthonormal.
template <typename T, int kDof, int kRows>
struct Reflections {
  static Index count(const LatentRows& in) { return kRows > 0 ? kRows : in.rows; }

  // Returns the least pivot over
  // the largest; NaN where there is none.
  SYMKIN_FLATTEN static T prepare(const LatentRows& in, Index pack) {
    using std::sqrt;
    const Index m = count(in);
    const Pack<T> b(in, pack, in.places.by_pose), q(in, pack, in.places.reflectors);
    const Pack<T> diagonal(in, pack, in.places.diagonal), factors(in, pack, in.places.factors);
    const Pack<T> lengths(in, pack, in.places.lengths);
    const T zero(0.0), one(1.0);
    for (Index i = 0; i < m; ++i) {
      T square(0.0);
      for (Index k = 0; k < kDof; ++k) {
        square = square + b[i * kDof + k] * b[i * kDof + k];
      }
      const T length = Lanes<T>::select(square > zero, one / sqrt(square), one);
      lengths.set(i, length);
      for (Index k = 0; k < kDof; ++k) {
        q.set(i * kDof + k, b[i * kDof + k] * length);
      }
    }
    T least(0.0), most(0.0);
    for (Index k = 0; k < kDof; ++k) {
      T square(0.0);
      for (Index i = k; i < m; ++i) {
        square = square + q[i * kDof + k] * q[i * kDof + k];
      }
      const T length = sqrt(square);
      const T head = q[k * kDof + k];
      const T pivot = Lanes<T>::select(head < zero, length, -length);
      const T factor = one / (length * (length + Lanes<T>::select(head < zero, -head, head)));
      q.set(k * kDof + k, head - pivot);
      diagonal.set(k, pivot);
      factors.set(k, factor);
      least = k == 0 ? length : Lanes<T>::select(length >= least, least, length);
      most = Lanes<T>::select(length >= most, length, most);
      for (Index j = k + 1; j < kDof; ++j) {
        T sum(0.0);
        for (Index i = k; i < m; ++i) {
          sum = sum + q[i * kDof + k] * q[i * kDof + j];
        }
        sum = sum * factor;
        for (Index i = k; i < m; ++i) {
          q.set(i * kDof + j, q[i * kDof + j] - sum * q[i * kDof + k]);
        }
      }
    }
    return least / most;
  }

  // E, in the place of the conditions.
  SYMKIN_FLATTEN static void leave(const LatentRows& in, Index pack, T* sums) {
    const Index m = count(in), r = m - kDof;
    const Pack<T> q(in, pack, in.places.reflectors), factors(in, pack, in.places.factors);
    const Pack<T> g(in, pack, in.places.conditions);
    for (Index i = 0; i < m; ++i) {
      for (Index j = 0; j < r; ++j) {
        g.set(i * r + j, T(i == kDof + j ? 1.0 : 0.0));
      }
    }
    for (Index k = kDof; k-- > 0;) {
      for (Index j = 0; j < r; ++j) {
        sums[j] = T(0.0);
      }
      for (Index i = k; i < m; ++i) {
        for (Index j = 0; j < r; ++j) {
          sums[j] = sums[j] + q[i * kDof + k] * g[i * r + j];
        }
      }
      for (Index i = k; i < m; ++i) {
        const T share = factors[k] * q[i * kDof + k];
        for (Index j = 0; j < r; ++j) {
          g.set(i * r + j, g[i * r + j] - share * sums[j]);
        }
      }
    }
  }

  // z <- B^+ (-z), for z that B explains.
  static void solve(const LatentRows& in, Index pack, T* z) {
    const Pack<T> q(in, pack, in.places.reflectors), lengths(in, pack, in.places.lengths);
    const Pack<T> diagonal(in, pack, in.places.diagonal), factors(in, pack, in.places.factors);
    const Index m = count(in);
    for (Index i = 0; i < m; ++i) {
      z[i] = -z[i] * lengths[i];
    }
    for (Index k = 0; k < kDof; ++k) {
      T sum(0.0);
      for (Index i = k; i < m; ++i) {
        sum = sum + q[i * kDof + k] * z[i];
      }
      sum = sum * factors[k];
      for (Index i = k; i < m; ++i) {
        z[i] = z[i] - sum * q[i * kDof + k];
      }
    }
    for (Index k = kDof; k-- > 0;) {
      for (Index j = k + 1; j < kDof; ++j) {
        z[k] = z[k] - q[k * kDof + j] * z[j];
      }
      z[k] = z[k] / diagonal[k];
    }
  }
};

// Where a pose was measured in full, by B_b^-1 of its rows alone, which is cheaper: with K = B_c
// B_b^-1 of the others, E is one at these and -K' at the basis. The position's rows are a
// rotation's, and those of the orientation do not depend on the position.
template <typename T, int kDof, int kRows>
struct FullPose {
  static Index count(const LatentRows& in) { return kRows > 0 ? kRows : in.rows; }

  // Returns the determinant.
  SYMKIN_FLATTEN static T prepare(const LatentRows& in, Index pack) {
    const Index p = in.position, turns = kDof - p;
    const Pack<T> b(in, pack, in.places.by_pose + in.basis * kDof);
    const Pack<T> q(in, pack, in.places.reflectors);
    T inverse[3][3], determinant(1.0);
    if (turns == 1) {
      determinant = b[p * kDof + p];
      inverse[0][0] = T(1.0) / determinant;
    } else if (turns == 3) {
      const auto element = [&](Index i, Index j) { return b[(p + i % 3) * kDof + p + j % 3]; };
      determinant = T(0.0);
      for (Index i = 0; i < 3; ++i) {
        for (Index j = 0; j < 3; ++j) {
          inverse[j][i] = element(i + 1, j + 1) * element(i + 2, j + 2) -
                          element(i + 1, j + 2) * element(i + 2, j + 1);
        }
        determinant = determinant + element(i, 0) * inverse[0][i];
      }
      const T factor = T(1.0) / determinant;
      for (auto& row : inverse) {
        for (T& value : row) {
          value = value * factor;
        }
      }
    }
    for (Index i = 0; i < kDof; ++i) {
      for (Index j = 0; j < p; ++j) {
        q.set(i * kDof + j, i < p ? b[j * kDof + i] : T(0.0));
      }
      for (Index j = 0; j < turns; ++j) {
        T value(0.0);
        if (i >= p) {
          value = inverse[i - p][j];
        } else {
          for (Index k = 0; k < p; ++k) {
            T by_turn = b[k * kDof + p] * inverse[0][j];
            for (Index l = 1; l < turns; ++l) {
              by_turn = by_turn + b[k * kDof + p + l] * inverse[l][j];
            }
            value = value - b[k * kDof + i] * by_turn;
          }
        }
        q.set(i * kDof + p + j, value);
      }
    }
    return Lanes<T>::select(determinant < T(0.0), -determinant, determinant);
  }

  SYMKIN_FLATTEN static void leave(const LatentRows& in, Index pack, T* /*room*/) {
    const Index r = count(in) - kDof;
    const Pack<T> b(in, pack, in.places.by_pose), q(in, pack, in.places.reflectors);
    const Pack<T> g(in, pack, in.places.conditions);
    for (Index j = 0; j < r; ++j) {
      const Index row = j < in.basis ? j : j + kDof;
      for (Index i = 0; i < kDof; ++i) {
        T value(0.0);
        for (Index k = 0; k < kDof; ++k) {
          value = value - b[row * kDof + k] * q[k * kDof + i];
        }
        g.set((in.basis + i) * r + j, value);
      }
      for (Index i = 0; i < r; ++i) {
        g.set(row * r + i, T(i == j ? 1.0 : 0.0));
      }
    }
  }

  static void solve(const LatentRows& in, Index pack, T* z) {
    const Pack<T> q(in, pack, in.places.reflectors);
    T x[kDof];
    for (Index i = 0; i < kDof; ++i) {
      x[i] = T(0.0);
      for (Index k = 0; k < kDof; ++k) {
        x[i] = x[i] - q[i * kDof + k] * z[in.basis + k];
      }
    }
    std::copy(x, x + kDof, z);
  }
};

}  // namespace symkin::detail
