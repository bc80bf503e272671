// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <xsimd/xsimd.hpp>

#include "symkin/model/jet.hpp"

// A batch as the scalar of a jet: Eigen stores the derivatives.
template <typename Arch>
struct Eigen::NumTraits<xsimd::batch<double, Arch>>
    : Eigen::GenericNumTraits<xsimd::batch<double, Arch>> {
  using Real = xsimd::batch<double, Arch>;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = double;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0 };
  enum { ReadCost = 1, AddCost = 1, MulCost = 1 };
};

// Ceres' jets mix with their own scalar alone; constants of a closure are doubles.
namespace ceres {
#define SYMKIN_JETS_WITH_CONSTANTS(op)                                             \
  template <typename Arch, int N>                                                  \
  auto operator op(const Jet<xsimd::batch<double, Arch>, N>& x, double constant) { \
    return x op xsimd::batch<double, Arch>(constant);                              \
  }                                                                                \
  template <typename Arch, int N>                                                  \
  auto operator op(double constant, const Jet<xsimd::batch<double, Arch>, N>& x) { \
    return xsimd::batch<double, Arch>(constant) op x;                              \
  }
SYMKIN_JETS_WITH_CONSTANTS(+)
SYMKIN_JETS_WITH_CONSTANTS(-)
SYMKIN_JETS_WITH_CONSTANTS(*)
SYMKIN_JETS_WITH_CONSTANTS(/)
#undef SYMKIN_JETS_WITH_CONSTANTS
}  // namespace ceres

namespace symkin {

template <typename Arch>
struct Lanes<xsimd::batch<double, Arch>> {
  using Batch = xsimd::batch<double, Arch>;
  using Mask = xsimd::batch_bool<double, Arch>;
  static constexpr int kCount = static_cast<int>(Batch::size);

  static Batch select(const Mask& mask, const Batch& yes, const Batch& no) {
    return xsimd::select(mask, yes, no);
  }
  static bool any(const Mask& mask) { return xsimd::any(mask); }
  static bool lane(const Mask& mask, int lane) { return mask.get(static_cast<std::size_t>(lane)); }

  static Batch load(const double* from) { return Batch::load_unaligned(from); }
  static void store(const Batch& value, double* to) { value.store_unaligned(to); }
  static Batch gather(const double* from, const Index* offsets) {
    return gather(from, offsets, std::make_integer_sequence<int, kCount>());
  }
  static void scatter(const Batch& value, double* to, const Index* offsets) {
    alignas(Batch) double values[kCount];
    value.store_aligned(values);
    for (int i = 0; i < kCount; ++i) {
      to[offsets[i]] = values[i];
    }
  }

  // Put together in registers: a batch that is read where its numbers were just written one by one
  // waits for them.
  template <int... kLanes>
  static Batch gather(const double* from, const Index* offsets,
                      std::integer_sequence<int, kLanes...> /*lanes*/) {
    return Batch{from[offsets[kLanes]]...};
  }

  // By the polynomials of fdlibm. xsimd's own reduce the angle in one of four ways, by the largest
  // in the batch, so that a result would depend on its neighbours.
  static void cosine_sine(const Batch& angle, Batch& cosine, Batch& sine) {
    constexpr double kMagic = 0x1.8p52;  // a sum with it is whole
    const Batch turns = (angle * 0.63661977236758134308 + kMagic) - kMagic;
    const Batch x =
        ((angle - turns * 1.57079632673412561417e+00) - turns * 6.07710050630396597660e-11) -
        turns * 2.02226624879595063154e-21;
    const Batch z = x * x;
    const Batch z2 = z * z;
    const Batch z4 = z2 * z2;
    const Batch s = x + x * z *
                            ((-1.66666666666666324348e-01 + z * 8.33333333332248946124e-03) +
                             z2 * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06) +
                             z4 * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10));
    const Batch half = 0.5 * z;
    const Batch rest = 1.0 - half;
    const Batch c =
        rest + (((1.0 - rest) - half) +
                z2 * ((4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) +
                      z2 * (2.48015872894767294178e-05 + z * -2.75573143513906633035e-07) +
                      z4 * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)));
    // -2 to 2, from which quadrant and signs follow without a look at the bits: how xsimd casts
    // them changes from version to version.
    const Batch quadrant = turns - 4.0 * ((0.25 * turns + kMagic) - kMagic);
    const Mask odd = xsimd::abs(quadrant) == Batch(1.0);
    const Batch upright = xsimd::select(odd, c, s);
    const Batch level = xsimd::select(odd, s, c);
    const Mask below = (quadrant < Batch(0.0)) | (quadrant > Batch(1.0));
    const Mask left = (quadrant > Batch(0.0)) | (quadrant < Batch(-1.0));
    sine = xsimd::select(below, -upright, upright);
    cosine = xsimd::select(left, -level, level);
    const Mask far = xsimd::abs(angle) > Batch(1e5);
    if (xsimd::any(far)) {
      alignas(Batch) double a[kCount], cosines[kCount], sines[kCount];
      angle.store_aligned(a);
      for (int i = 0; i < kCount; ++i) {
        Lanes<double>::cosine_sine(a[i], cosines[i], sines[i]);
      }
      cosine = xsimd::select(far, Batch::load_aligned(cosines), cosine);
      sine = xsimd::select(far, Batch::load_aligned(sines), sine);
    }
  }
};

}  // namespace symkin
