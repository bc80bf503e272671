// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "symkin/estimation/detail/latent_basis.hpp"
#include "symkin/estimation/detail/latent_observed.hpp"

namespace symkin::detail {

// kRows rows of each pose, or any number (0).
template <typename T, int kDof, int kRows>
class LatentElimination {
  using Any = Reflections<T, kDof, kRows>;
  using Full = FullPose<T, kDof, kRows>;

  static Index count(const LatentRows& in) { return kRows > 0 ? kRows : in.rows; }

  using Room = std::unique_ptr<T[]>;
  static Room room(Index count) { return Room(new T[static_cast<std::size_t>(count)]); }

 public:
  static void eliminate(const LatentRows& in) {
    if (in.directions > factors::kBase) {
      ObservedLanes<T, factors::kDirections>::fill(in);
    } else if (in.directions > factors::kOwn) {
      ObservedLanes<T, factors::kBase>::fill(in);
    } else {
      ObservedLanes<T, factors::kOwn>::fill(in);
    }
    const Index r = count(in) - kDof;
    const Room lower = room(r * r + r);
    for (Index pack = 0; pack < packs<T>(in); ++pack) {
      closures(in, pack);
      const T singular = in.basis < 0 ? Any::prepare(in, pack) : Full::prepare(in, pack);
      condition(in, pack, singular, lower.get());
    }
  }

  SYMKIN_FLATTEN static void move(const LatentRows& in, const double* step, double* tangents,
                                  double* errors) {
    const Index m = count(in), r = m - kDof, bound = in.legs * in.closures;
    const Room rows = room(2 * m + r);
    T* const z = rows.get();
    T* const multipliers = z + m;
    T* const along = multipliers + m;
    for (Index pack = 0; pack < packs<T>(in); ++pack) {
      const LaneRows<T> at(pack * Lanes<T>::kCount, in.count);
      const Pack<T> y(in, pack, in.places.misfits), v(in, pack, in.places.variances);
      const Pack<T> own(in, pack, in.places.by_unknowns), others(in, pack, in.places.by_shared);
      const Pack<T> g(in, pack, in.places.conditions);
      for (Index i = 0; i < m; ++i) {
        const bool closure = i < bound;
        const Index width = closure ? in.width : in.shared;
        const Index first = (closure ? i : i - bound) * width;
        const double* const d = step + (closure ? i / in.closures : in.legs) * in.width;
        z[i] = y[i];
        for (Index k = 0; k < width; ++k) {
          z[i] = z[i] + (closure ? own : others)[first + k] * d[k];
        }
      }
      for (Index j = 0; j < r; ++j) {
        along[j] = g[j] * z[0];
        for (Index i = 1; i < m; ++i) {
          along[j] = along[j] + g[i * r + j] * z[i];
        }
      }
      for (Index i = 0; i < m; ++i) {
        multipliers[i] = T(0.0);
        for (Index j = 0; j < r; ++j) {
          multipliers[i] = multipliers[i] + g[i * r + j] * along[j];
        }
        z[i] = z[i] - v[i] * multipliers[i];
      }
      for (Index leg = 0; leg < in.legs; ++leg) {
        const LatentRows::OfLeg& of_leg = in.of_legs[leg];
        const T by_reading = of_leg.packs == nullptr
                                 ? at.read(of_leg.by_reading, in.closures)
                                 : packed(in, of_leg, pack, 1 + in.width + kDof);
        const T variance = at.read(in.variances + leg * in.closures, in.rows);
        const T error = -by_reading * variance * multipliers[leg * in.closures];
        at.write(Lanes<T>::select(variance >= T(0.0), error, T(0.0)), errors + leg, in.legs);
      }
      in.basis < 0 ? Any::solve(in, pack, z) : Full::solve(in, pack, z);
      for (Index i = 0; i < kDof; ++i) {
        at.write(z[i], tangents + i, kDof);
      }
    }
  }

 private:
  static T packed(const LatentRows& in, const LatentRows::OfLeg& leg, Index pack, Index i) {
    return Lanes<T>::load(leg.packs + (pack * (in.width + kDof + 2) + i) * Lanes<T>::kCount);
  }

  // y, V, B and C of the legs.
  SYMKIN_FLATTEN static void closures(const LatentRows& in, Index pack) {
    const LaneRows<T> at(pack * Lanes<T>::kCount, in.count);
    const Pack<T> y(in, pack, in.places.misfits), v(in, pack, in.places.variances);
    const Pack<T> b(in, pack, in.places.by_pose), c(in, pack, in.places.by_unknowns);
    for (Index leg = 0; leg < in.legs; ++leg) {
      const LatentRows::OfLeg& of_leg = in.of_legs[leg];
      const T error = at.read(in.errors + leg, in.legs);
      if (of_leg.packs != nullptr) {
        const auto number = [&](Index i) { return packed(in, of_leg, pack, i); };
        const T variance = at.read(in.variances + leg, in.rows);
        const T g = number(1 + in.width + kDof);
        y.set(leg, number(0) - g * error);
        v.set(leg, Lanes<T>::select(variance >= T(0.0), g * g * variance, T(0.0)));
        for (Index i = 0; i < kDof; ++i) {
          b.set(leg * kDof + i, number(1 + in.width + i));
        }
        for (Index i = 0; i < in.width; ++i) {
          c.set(leg * in.width + i, number(1 + i));
        }
        continue;
      }
      for (Index k = 0; k < in.closures; ++k) {
        const Index row = leg * in.closures + k;
        const T variance = at.read(in.variances + row, in.rows);
        const T g = at.read(of_leg.by_reading + k, in.closures);
        y.set(row, at.read(of_leg.closure + k, in.closures) - g * error);
        v.set(row, Lanes<T>::select(variance >= T(0.0), g * g * variance, T(0.0)));
        for (Index i = 0; i < kDof; ++i) {
          b.set(row * kDof + i, at.read(of_leg.by_pose + k * kDof + i, in.closures * kDof));
        }
        for (Index i = 0; i < in.width; ++i) {
          c.set(row * in.width + i,
                at.read(of_leg.by_unknowns + k * in.width + i, in.closures * in.width));
        }
      }
    }
  }

  // G by the Cholesky factor of the covariance of E'e; and what follows from it.
  SYMKIN_FLATTEN static void condition(const LatentRows& in, Index pack, const T& singular,
                                       T* lower) {
    using std::sqrt;
    const LaneRows<T> at(pack * Lanes<T>::kCount, in.count);
    const Index m = count(in), r = m - kDof, bound = in.legs * in.closures;
    const Pack<T> lengths(in, pack, in.places.lengths), g(in, pack, in.places.conditions);
    const Pack<T> y(in, pack, in.places.misfits), v(in, pack, in.places.variances);
    const Pack<T> c(in, pack, in.places.by_shared);
    const Pack<T> rho(in, pack, in.places.rho), jacobian(in, pack, in.places.jacobian);
    const T zero(0.0), one(1.0);
    T* const sums = lower + r * r;
    in.basis < 0 ? Any::leave(in, pack, sums) : Full::leave(in, pack, sums);
    // Of the row i of an oblique E all but this column is zero, and of G what is before it.
    const auto own = [&](Index i) {
      return in.basis < 0 || (i >= in.basis && i < in.basis + kDof) ? Index{-1}
             : i < in.basis                                         ? i
                                                                    : i - kDof;
    };
    // A row that was not taken is a condition of its own; of about the others' variances, it costs
    // these no digits.
    T mean(1.0), size(0.0);
    for (Index i = 0; i < m; ++i) {
      size = size + y[i] * y[i];
    }
    if (in.basis < 0) {
      T sum(0.0), taken(0.0);
      for (Index i = 0; i < m; ++i) {
        sum = sum + v[i] * lengths[i] * lengths[i];
        taken = taken + Lanes<T>::select(at.read(in.variances + i, m) >= zero, one, zero);
      }
      mean = sum / taken;
    }
    for (Index i = 0; i < r * r; ++i) {
      lower[i] = zero;
    }
    for (Index i = 0; i < m; ++i) {
      T variance = in.basis < 0 ? v[i] * lengths[i] * lengths[i] : v[i];
      if (in.basis < 0 || i < in.basis || i >= in.basis + kDof) {
        variance = Lanes<T>::select(at.read(in.variances + i, m) >= zero, variance, mean);
      }
      if (own(i) >= 0) {
        lower[own(i) * (r + 1)] = lower[own(i) * (r + 1)] + variance;
        continue;
      }
      for (Index j = 0; j < r; ++j) {
        const T scaled = variance * g[i * r + j];
        for (Index k = 0; k <= j; ++k) {
          lower[j * r + k] = lower[j * r + k] + scaled * g[i * r + k];
        }
      }
    }
    constexpr double kSingular = 1e-6, kLost = 1e-10;  // of B, and of a variance
    auto clear = (singular > T(kSingular)) & (size < T(std::numeric_limits<double>::infinity()));
    for (Index j = 0; j < r; ++j) {
      sums[j] = T(kLost) * lower[j * r + j];
    }
    for (Index k = 0; k < r; ++k) {
      const T pivot = lower[k * r + k];  // what is left of the variance
      clear = clear & (pivot > sums[k]);
      const T inverse = one / sqrt(pivot);
      lower[k * r + k] = inverse;
      for (Index i = k + 1; i < r; ++i) {
        lower[i * r + k] = lower[i * r + k] * inverse;
      }
      for (Index i = k + 1; i < r; ++i) {
        for (Index j = k + 1; j <= i; ++j) {
          lower[i * r + j] = lower[i * r + j] - lower[i * r + k] * lower[j * r + k];
        }
      }
    }
    for (Index i = 0; i < m; ++i) {
      const Index from = std::max<Index>(own(i), 0);
      for (Index k = from; k < r; ++k) {
        const T element = g[i * r + k] * lower[k * r + k];
        const T scaled = in.basis < 0 ? element * lengths[i] : element;
        g.set(i * r + k, Lanes<T>::select(clear, scaled, zero));
        for (Index j = k + 1; j < r; ++j) {
          g.set(i * r + j, g[i * r + j] - lower[j * r + k] * element);
        }
      }
    }
    T square(0.0);
    for (Index j = 0; j < r; ++j) {
      T value(0.0);
      for (Index i = 0; i < m; ++i) {
        value = value + g[i * r + j] * y[i];
      }
      value = Lanes<T>::select(clear, value, zero);
      rho.set(j, value);
      square = square + value * value;
      for (Index s = 0; s < in.shared; ++s) {
        T by_shared(0.0);
        for (Index i = bound; i < m; ++i) {
          by_shared = by_shared + g[i * r + j] * c[(i - bound) * in.shared + s];
        }
        jacobian.set(j * in.shared + s, Lanes<T>::select(clear, by_shared, zero));
      }
    }
    at.write(square, in.chi_squares, 1);
    at.write(Lanes<T>::select(clear, one, zero), in.clear, 1);
  }
};

}  // namespace symkin::detail
