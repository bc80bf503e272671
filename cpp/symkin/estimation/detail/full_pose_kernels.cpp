// SPDX-License-Identifier: MIT

// Compiled twice on x86-64, see chains/detail/kernels.hpp: several poses side by side, as many as
// the processor holds, and numbers of legs and scalars that the compiler knows where they are
// usual. Together that is about 3 times the speed of one pose at a time.
#include "symkin/estimation/detail/full_pose_kernels.hpp"

#include <cmath>
#include <type_traits>
#include <utility>

#include "symkin/chains/detail/kernels.hpp"
#include "symkin/model/batched_leg.hpp"
#include "symkin/support/processor.hpp"

namespace symkin {
namespace detail {

// kLegs legs and as many degrees of freedom, or any numbers (0).
template <typename T, int kLegs>
class FullPoseLanes {
  static constexpr int kMost = kLegs > 0 ? kLegs : static_cast<int>(FullPoseKernels::kMostLegs);
  static constexpr int kMostDof = 6;
  using Rows = LaneRows<T>;

  static Index legs(const FullPoseRows& rows) { return kLegs > 0 ? kLegs : rows.legs; }
  static Index dof(const FullPoseRows& rows) { return kLegs > 0 ? kLegs : rows.dof; }
  static Index triangle(Index n) { return n * (n + 1) / 2; }

 public:
  SYMKIN_FLATTEN static void eliminate(const FullPoseRows& rows) {
    const Index n = legs(rows);
    const Index size = dof(rows);
    for (Index first = 0; first < rows.count; first += Lanes<T>::kCount) {
      const Rows at(first, rows.count);
      T misfit[kMostDof], variance[kMostDof], turn[9];
      for (Index i = 0; i < size; ++i) {
        misfit[i] = at.read(rows.misfits + i, size);
        variance[i] = at.read(rows.pose_variances + i, size);
      }
      for (Index i = 0; size == 6 && i < 9; ++i) {
        turn[i] = at.read(rows.turns + i, 9);
      }
      // Conditions, and the covariance H Sigma H' + diag(g^2 sigma_q^2) with H on the tangent of
      // the measured pose; ones where a leg was not read.
      T h[kMost][kMostDof], conditions[kMost], lower[kMost][kMost], unread[kMost];
      for (Index leg = 0; leg < n; ++leg) {
        const FullPoseRows::OfLeg& of_leg = rows.of_legs[leg];
        for (Index i = 0; i < size; ++i) {
          h[leg][i] = at.read(of_leg.by_pose + i, size);
        }
        if (size == 6) {
          const T turned[] = {h[leg][3], h[leg][4], h[leg][5]};
          for (Index i = 0; i < 3; ++i) {
            h[leg][3 + i] =
                turned[0] * turn[3 * i] + turned[1] * turn[3 * i + 1] + turned[2] * turn[3 * i + 2];
          }
        }
        const T g = at.read(of_leg.by_reading, 1);
        unread[leg] = at.read(rows.unread + leg, n);
        conditions[leg] = at.read(of_leg.closure, 1) - g * at.read(rows.errors + leg, n);
        T scaled[kMostDof];
        for (Index i = 0; i < size; ++i) {
          conditions[leg] = conditions[leg] - h[leg][i] * misfit[i];
          scaled[i] = h[leg][i] * variance[i];
        }
        for (Index other = 0; other <= leg; ++other) {
          T sum = scaled[0] * h[other][0];
          for (Index i = 1; i < size; ++i) {
            sum = sum + scaled[i] * h[other][i];
          }
          lower[leg][other] = sum;
        }
        lower[leg][leg] =
            lower[leg][leg] + (g * g * at.read(rows.reading_variances + leg, n) + unread[leg]);
      }
      // Cholesky's factor in place, its inverse, and from that the precisions.
      T inverse[kMost][kMost];
      T least(1.0);
      for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < i; ++j) {
          T value = lower[i][j];
          for (Index k = 0; k < j; ++k) {
            value = value - lower[i][k] * lower[j][k];
          }
          lower[i][j] = value * inverse[j][j];
        }
        T pivot = lower[i][i];
        for (Index k = 0; k < i; ++k) {
          pivot = pivot - lower[i][k] * lower[i][k];
        }
        using std::sqrt;
        const T left = pivot / lower[i][i];
        least = Lanes<T>::select(left >= least, least, left);  // NaN if it is
        inverse[i][i] = 1.0 / sqrt(pivot);
        for (Index j = 0; j < i; ++j) {
          T value = lower[i][j] * inverse[j][j];
          for (Index k = j + 1; k < i; ++k) {
            value = value + lower[i][k] * inverse[k][j];
          }
          inverse[i][j] = -(value * inverse[i][i]);
        }
      }
      T whitened[kMost];
      T square(0.0);
      for (Index i = 0; i < n; ++i) {
        whitened[i] = inverse[i][0] * conditions[0];
        for (Index j = 1; j <= i; ++j) {
          whitened[i] = whitened[i] + inverse[i][j] * conditions[j];
        }
        square = square + whitened[i] * whitened[i];
      }
      at.write(square, rows.chi_squares, 1);
      at.write(least, rows.pivots, 1);
      for (Index i = 0; i < n; ++i) {
        T multiplier = inverse[i][i] * whitened[i];
        for (Index k = i + 1; k < n; ++k) {
          multiplier = multiplier + inverse[k][i] * whitened[k];
        }
        at.write(multiplier, rows.multipliers + i, n);
        for (Index j = 0; j <= i; ++j) {
          T precision = inverse[i][i] * inverse[i][j];
          for (Index k = i + 1; k < n; ++k) {
            precision = precision + inverse[k][i] * inverse[k][j];
          }
          at.write(i == j ? precision - unread[i] : precision, rows.precisions + triangle(i) + j,
                   triangle(n));
        }
      }
    }
  }

  SYMKIN_FLATTEN static void move(const FullPoseRows& rows, const double* effects, double* moves,
                                  double* errors) {
    const Index n = legs(rows);
    const Index size = dof(rows);
    for (Index first = 0; first < rows.count; first += Lanes<T>::kCount) {
      const Rows at(first, rows.count);
      T effect[kMost], multipliers[kMost], move[kMostDof];
      for (Index i = 0; i < n; ++i) {
        effect[i] = at.read(effects + i, n);
        multipliers[i] = -at.read(rows.multipliers + i, n);
      }
      for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j <= i; ++j) {
          const T precision = at.read(rows.precisions + triangle(i) + j, triangle(n));
          multipliers[i] = multipliers[i] - precision * effect[j];
          if (j < i) {
            multipliers[j] = multipliers[j] - precision * effect[i];
          }
        }
      }
      for (Index i = 0; i < size; ++i) {
        move[i] = T(0.0);
      }
      for (Index leg = 0; leg < n; ++leg) {
        const FullPoseRows::OfLeg& of_leg = rows.of_legs[leg];
        for (Index i = 0; i < size; ++i) {
          move[i] = move[i] + at.read(of_leg.by_pose + i, size) * multipliers[leg];
        }
        const T g = at.read(of_leg.by_reading, 1);
        at.write(g * at.read(rows.reading_variances + leg, n) * multipliers[leg], errors + leg, n);
      }
      // To the tangent of the measured pose, where the variances are, and back.
      T turn[9];
      for (Index i = 0; size == 6 && i < 9; ++i) {
        turn[i] = at.read(rows.turns + i, 9);
      }
      if (size == 6) {
        const T turned[] = {move[3], move[4], move[5]};
        for (Index i = 0; i < 3; ++i) {
          move[3 + i] =
              turned[0] * turn[3 * i] + turned[1] * turn[3 * i + 1] + turned[2] * turn[3 * i + 2];
        }
      }
      for (Index i = 0; i < size; ++i) {
        move[i] =
            at.read(rows.pose_variances + i, size) * move[i] - at.read(rows.misfits + i, size);
      }
      if (size == 6) {
        const T turned[] = {move[3], move[4], move[5]};
        for (Index i = 0; i < 3; ++i) {
          move[3 + i] = turn[i] * turned[0] + turn[3 + i] * turned[1] + turn[6 + i] * turned[2];
        }
      }
      for (Index i = 0; i < size; ++i) {
        at.write(move[i], moves + i, size);
      }
    }
  }
};

template <typename T>
void eliminate(const FullPoseRows& rows) {
  const bool square = rows.legs == rows.dof;
  if (square && rows.dof == 6) {
    FullPoseLanes<T, 6>::eliminate(rows);
  } else if (square && rows.dof == 3) {
    FullPoseLanes<T, 3>::eliminate(rows);
  } else {
    FullPoseLanes<T, 0>::eliminate(rows);
  }
}

template <typename T>
void move(const FullPoseRows& rows, const double* effects, double* moves, double* errors) {
  const bool square = rows.legs == rows.dof;
  if (square && rows.dof == 6) {
    FullPoseLanes<T, 6>::move(rows, effects, moves, errors);
  } else if (square && rows.dof == 3) {
    FullPoseLanes<T, 3>::move(rows, effects, moves, errors);
  } else {
    FullPoseLanes<T, 0>::move(rows, effects, moves, errors);
  }
}

template <typename T>
T load(const double* from) {
  if constexpr (std::is_same_v<T, double>) {
    return *from;
  } else {
    return T::load_unaligned(from);
  }
}

template <typename T>
void store(const T& value, double* to) {
  if constexpr (std::is_same_v<T, double>) {
    *to = value;
  } else {
    value.store_unaligned(to);
  }
}

// Of two poses at once, which halves the traffic of the sums. The scalars of a leg, side by side in
// T, are of a number that the compiler knows, or of any (0).
template <typename T, int kWidth>
SYMKIN_FLATTEN void add_pairs(const FullPoseRows& rows, const Index* poses, Index count,
                              const double* weights, double* __restrict information,
                              double* __restrict gradient) {
  const Index width = kWidth > 0 ? kWidth : rows.width;
  const Index stride = rows.legs * width;
  const Index triangle = rows.legs * (rows.legs + 1) / 2;
  for (Index k = 0; k < count; k += 2) {
    const Index p = poses[k];
    const Index q = poses[k + 1 < count ? k + 1 : k];
    const double at_p = weights[p];
    const double at_q = k + 1 < count ? weights[q] : 0;
    const double* by_p = rows.precisions + p * triangle;
    const double* by_q = rows.precisions + q * triangle;
    for (Index i = 0; i < rows.legs; ++i) {
      const double* a_p = rows.of_legs[i].by_unknowns + p * width;
      const double* a_q = rows.of_legs[i].by_unknowns + q * width;
      const double force_p = at_p * rows.multipliers[p * rows.legs + i];
      const double force_q = at_q * rows.multipliers[q * rows.legs + i];
      for (Index s = 0; s < width; ++s) {
        gradient[i * width + s] += force_p * a_p[s] + force_q * a_q[s];
      }
      for (Index j = 0; j <= i; ++j) {
        const double* b_p = rows.of_legs[j].by_unknowns + p * width;
        const double* b_q = rows.of_legs[j].by_unknowns + q * width;
        const double precision_p = at_p * *by_p++;
        const double precision_q = at_q * *by_q++;
        for (Index s = 0; s < width; ++s) {
          double* __restrict row = information + (i * width + s) * stride + j * width;
          const double x = precision_p * a_p[s];
          const double y = precision_q * a_q[s];
          Index t = 0;
          for (; t + Lanes<T>::kCount <= width; t += Lanes<T>::kCount) {
            store(load<T>(row + t) + (x * load<T>(b_p + t) + y * load<T>(b_q + t)), row + t);
          }
          for (; t < width; ++t) {
            row[t] += x * b_p[t] + y * b_q[t];
          }
        }
      }
    }
  }
}

template <typename T, int... kWidths>
void add(const FullPoseRows& rows, const Index* poses, Index count, const double* weights,
         double* information, double* gradient, std::integer_sequence<int, kWidths...> /*widths*/) {
  constexpr decltype(FullPoseKernels::add) kOfWidth[] = {add_pairs<T, kWidths>...};
  const bool usual = rows.width < static_cast<Index>(sizeof...(kWidths));
  kOfWidth[usual ? rows.width : 0](rows, poses, count, weights, information, gradient);
}

template <typename T>
void add(const FullPoseRows& rows, const Index* poses, Index count, const double* weights,
         double* information, double* gradient) {
  add<T>(rows, poses, count, weights, information, gradient, std::make_integer_sequence<int, 13>());
}

template <typename T>
struct FullPoseKernelsOf {
  static constexpr FullPoseKernels kTable{eliminate<T>, add<T>, move<T>};
};

}  // namespace detail

#ifdef SYMKIN_COMPILES_AVX2
const FullPoseKernels* full_pose_kernels_avx2() {
  return &detail::FullPoseKernelsOf<chains::Scalar<xsimd::avx2>>::kTable;
}
#else
#ifdef SYMKIN_HAS_AVX2
const FullPoseKernels* full_pose_kernels_avx2();
#endif

const FullPoseKernels& full_pose_kernels() {
#ifdef SYMKIN_HAS_AVX2
  if (processor() >= Processor::avx2) {
    return *full_pose_kernels_avx2();
  }
#endif
  return detail::FullPoseKernelsOf<chains::Scalar<xsimd::default_arch>>::kTable;
}
#endif

}  // namespace symkin
