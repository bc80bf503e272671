// SPDX-License-Identifier: MIT

// Compiled twice on x86-64, see chains/detail/kernels.hpp: a leg a lane.
#include "symkin/estimation/detail/lane_kernels.hpp"

#include <cmath>

#include "symkin/estimation/detail/kernels_of_processor.hpp"
#include "symkin/model/batched_leg.hpp"

namespace symkin {
namespace detail {

template <typename T>
class LaneAlgebra {
  static constexpr Index kLanes = Lanes<T>::kCount;
  static constexpr Index kTogether = 4;   // rows that are summed at once
  static constexpr double kLeast = 1e-6;  // of 1 - leverage

  static T get(const double* from, Index i) { return Lanes<T>::load(from + i * kLanes); }
  static void set(double* to, Index i, const T& value) { Lanes<T>::store(value, to + i * kLanes); }
  static double* at(double* from, Index i) { return from + i * kLanes; }
  static T root(const T& value) {
    using std::sqrt;
    return sqrt(value);
  }
  static Index width(const ClosureLanes& in) { return in.parameters + in.dof + 2; }
  static double* row(const ClosureLanes& in, Index i) { return at(in.rows, i * width(in)); }

 public:
  SYMKIN_FLATTEN static void whiten(const ClosureLanes& in, const double* pose_variances,
                                    double reading_variance, const double* present,
                                    const LaneSums& sums) {
    T of_closures(0.0), judged(0.0), whitened(0.0);
    const Index first = 1 + in.parameters, last = first + in.dof;
    const auto covariance = [&](const double* a, const double* b) {
      T sum = get(a, last) * get(b, last) * reading_variance;
      for (Index i = first; i < last; ++i) {
        sum = sum + get(a, i) * get(b, i) * pose_variances[i - first];
      }
      return sum;
    };
    for (Index k = 0; k < in.count; ++k) {
      const T is_there = get(present, k);
      T square(0.0);
      for (Index i = k * in.closures; i < (k + 1) * in.closures; ++i) {
        double* const own = row(in, i);
        of_closures = of_closures + is_there * get(own, 0) * get(own, 0);
        for (Index before = k * in.closures; before < i; ++before) {
          const double* const other = row(in, before);
          const T share = covariance(own, other) * get(in.precisions, before);
          for (Index j = 0; j <= last; ++j) {
            set(own, j, get(own, j) - share * get(other, j));
          }
        }
        const T h = get(own, 0);
        judged = judged + get(in.precisions, i) * h * h;
        const T precision = is_there / covariance(own, own);
        set(in.precisions, i, precision);
        square = square + precision * h * h;
      }
      set(in.squares, k, square);
      whitened = whitened + square;
    }
    set(sums.closures, 0, of_closures);
    set(sums.judged, 0, judged);
    set(sums.whitened, 0, whitened);
  }

  SYMKIN_FLATTEN static void sum(const ClosureLanes& in, const double* weights,
                                 const double* curvatures, double* information, double* gradient) {
    for (Index i = 0; i < in.size; ++i) {
      set(gradient, i, T(0.0));
      for (Index j = 0; j <= i; ++j) {
        set(information, i * in.size + j, T(0.0));
      }
    }
    // Rows side by side: h, J, and what they count.
    T factors[kTogether];
    double* const held = in.room;
    const Index stride = in.size + 1;
    Index some = 0;
    const auto add = [&] {
      for (; some < kTogether; ++some) {
        factors[some] = T(0.0);
        for (Index j = 0; j < stride; ++j) {
          set(held, some * stride + j, T(0.0));
        }
      }
      add_rows(factors, held, in.size, information, gradient);
      some = 0;
    };
    for (Index k = 0; k < in.count; ++k) {
      for (Index i = k * in.closures; i < (k + 1) * in.closures; ++i) {
        const double* const own = row(in, i);
        factors[some] = get(in.precisions, i);
        if (weights != nullptr) {
          factors[some] = factors[some] * get(weights, k);
        }
        set(held, some * stride, get(own, 0));
        for (Index j = 0; j < in.size; ++j) {
          set(held, some * stride + 1 + j, get(own, 1 + in.estimated[j]));
        }
        if (++some == kTogether) {
          add();
        }
      }
      if (curvatures != nullptr) {
        factors[some] = get(curvatures, k);
        set(held, some * stride, T(0.0));
        for (Index j = 0; j < in.size; ++j) {
          T along(0.0);
          for (Index i = k * in.closures; i < (k + 1) * in.closures; ++i) {
            const double* const own = row(in, i);
            along = along + get(own, 1 + in.estimated[j]) * get(own, 0) * get(in.precisions, i);
          }
          set(held, some * stride + 1 + j, along);
        }
        if (++some == kTogether) {
          add();
        }
      }
    }
    if (some > 0) {
      add();
    }
  }

  SYMKIN_FLATTEN static void solve(const ClosureLanes& in, const double* information,
                                   const double* gradient, double* step, double* decrease,
                                   double* least_pivot) {
    double* const scale = in.room;
    double* const factor = at(in.room, in.size);
    set(least_pivot, 0, factorise(in.size, information, scale, factor));
    for (Index i = 0; i < in.size; ++i) {
      set(step, i, get(scale, i) * get(gradient, i));
    }
    forwards(in.size, factor, step);
    T sum(0.0);
    for (Index i = 0; i < in.size; ++i) {
      sum = sum + get(step, i) * get(step, i);
    }
    set(decrease, 0, sum);
    backwards(in.size, factor, step);
    for (Index i = 0; i < in.size; ++i) {
      set(step, i, T(0.0) - get(scale, i) * get(step, i));
    }
  }

  SYMKIN_FLATTEN static void invert(const ClosureLanes& in, const double* information,
                                    double* inverse) {
    double* const scale = in.room;
    double* const factor = at(in.room, in.size);
    double* const half = at(factor, in.size * in.size);  // the inverse of the factor
    const Index n = in.size;
    factorise(n, information, scale, factor);
    for (Index i = 0; i < n; ++i) {
      const T own = get(factor, i * n + i);
      for (Index j = 0; j < i; ++j) {
        T value(0.0);
        for (Index k = j; k < i; ++k) {
          value = value - get(factor, i * n + k) * get(half, k * n + j);
        }
        set(half, i * n + j, value * own);
      }
      set(half, i * n + i, own);
    }
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j) {
        T value(0.0);
        for (Index k = i; k < n; ++k) {
          value = value + get(half, k * n + i) * get(half, k * n + j);
        }
        value = value * get(scale, i) * get(scale, j);
        set(inverse, i * n + j, value);
        set(inverse, j * n + i, value);
      }
    }
  }

  SYMKIN_FLATTEN static void influence(const ClosureLanes& in, const double* inverse,
                                       double* leverages, double* variances) {
    const Index n = in.size, closures = in.closures;
    double* const along = in.room;                 // C J', a row a closure
    double* const open = at(along, closures * n);  // 1 - leverages
    double* const factor = at(open, closures * closures);
    double* const deleted = at(factor, closures * closures);
    for (Index j = 0; j < n; ++j) {
      set(variances, j, T(0.0));
    }
    for (Index k = 0; k < in.count; ++k) {
      T leverage(0.0);
      for (Index a = 0; a < closures; ++a) {
        const double* const own = row(in, k * closures + a);
        const T size = root(get(in.precisions, k * closures + a));
        for (Index i = 0; i < n; ++i) {
          T value(0.0);
          for (Index j = 0; j < n; ++j) {
            value = value + get(inverse, i * n + j) * get(own, 1 + in.estimated[j]);
          }
          set(along, a * n + i, value * size);
        }
        for (Index b = 0; b <= a; ++b) {
          T value(0.0);
          for (Index i = 0; i < n; ++i) {
            value = value + get(along, b * n + i) * get(own, 1 + in.estimated[i]);
          }
          value = value * size;
          leverage = a == b ? leverage + value : leverage;
          set(open, a * closures + b, T(a > b ? 0.0 : closures > 1 ? 1 + kLeast : 1.0) - value);
        }
        set(deleted, a, get(own, 0) * size);
      }
      set(leverages, k, leverage * (1.0 / static_cast<double>(closures)));
      factorise(closures, open, nullptr, factor, kLeast);
      forwards(closures, factor, deleted);
      backwards(closures, factor, deleted);
      for (Index j = 0; j < n; ++j) {
        T change(0.0);
        for (Index a = 0; a < closures; ++a) {
          change = change + get(along, a * n + j) * get(deleted, a);
        }
        set(variances, j, get(variances, j) + change * change);
      }
    }
  }

 private:
  static void add_rows(const T (&factors)[kTogether], const double* held, Index size,
                       double* information, double* gradient) {
    const Index stride = size + 1;
    for (Index i = 0; i < size; ++i) {
      T x[kTogether];
      T sum = get(gradient, i);
      for (Index b = 0; b < kTogether; ++b) {
        x[b] = factors[b] * get(held, b * stride + 1 + i);
        sum = sum + x[b] * get(held, b * stride);
      }
      set(gradient, i, sum);
      for (Index j = 0; j <= i; ++j) {
        T square = get(information, i * size + j);
        for (Index b = 0; b < kTogether; ++b) {
          square = square + x[b] * get(held, b * stride + 1 + j);
        }
        set(information, i * size + j, square);
      }
    }
  }

  // L of a symmetric matrix, brought to a diagonal of ones where there is room for its scale, with
  // one over the diagonal of L in its place. Returns the least pivot; none is below `least`.
  static T factorise(Index n, const double* matrix, double* scale, double* factor,
                     double least = 0) {
    for (Index i = 0; scale != nullptr && i < n; ++i) {
      const T diagonal = get(matrix, i * n + i);
      set(scale, i, Lanes<T>::select(diagonal > T(0.0), T(1.0) / root(diagonal), T(1.0)));
    }
    T least_pivot(2.0);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j) {
        T value = get(matrix, i * n + j);
        if (scale != nullptr) {
          value = value * get(scale, i) * get(scale, j);
        }
        for (Index k = 0; k < j; ++k) {
          value = value - get(factor, i * n + k) * get(factor, j * n + k);
        }
        if (j < i) {
          set(factor, i * n + j, value * get(factor, j * n + j));
          continue;
        }
        value = least > 0 ? Lanes<T>::select(value > T(least), value, T(least)) : value;
        least_pivot = Lanes<T>::select(value > least_pivot, least_pivot, value);
        set(factor, i * n + i, T(1.0) / root(value));
      }
    }
    return least_pivot;
  }

  static void forwards(Index n, const double* factor, double* vector) {
    for (Index i = 0; i < n; ++i) {
      T value = get(vector, i);
      for (Index k = 0; k < i; ++k) {
        value = value - get(factor, i * n + k) * get(vector, k);
      }
      set(vector, i, value * get(factor, i * n + i));
    }
  }
  static void backwards(Index n, const double* factor, double* vector) {
    for (Index i = n - 1; i >= 0; --i) {
      T value = get(vector, i);
      for (Index k = i + 1; k < n; ++k) {
        value = value - get(factor, k * n + i) * get(vector, k);
      }
      set(vector, i, value * get(factor, i * n + i));
    }
  }
};

template <typename T>
struct LaneKernelsOf {
  using Algebra = LaneAlgebra<T>;
  static constexpr LaneKernels kTable{Lanes<T>::kCount, Algebra::whiten, Algebra::sum,
                                      Algebra::solve,   Algebra::invert, Algebra::influence};
};

}  // namespace detail

SYMKIN_KERNELS_OF_PROCESSOR(LaneKernels, lane_kernels, detail::LaneKernelsOf)

}  // namespace symkin
