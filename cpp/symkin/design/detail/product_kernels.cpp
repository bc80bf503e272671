// SPDX-License-Identifier: MIT
#include "symkin/design/detail/product_kernels.hpp"

#include <algorithm>

#include "symkin/support/registers.hpp"

namespace symkin::design::detail {
namespace {

using namespace registers;

// Candidates side by side in a register, a group of them at a time so that each coefficient is
// loaded once for all.
struct Wide {
  static constexpr Index kParts = kGroup / kLanes;
  // So many vectors at once, and parts of a group with them: their sums fill the registers.
  static constexpr Index kTogether = 6;
  static constexpr Index kStrip = kLanes == 8 ? 4 : 2;

  // sum[k] = sum over `size` columns of coefficient[c] * column c.
  template <Index kCount>
  SYMKIN_INLINE void combine(const double* x, const double* coefficients, Index size, Lanes* sum) {
    Lanes total[kCount] = {};
    for (Index c = 0; c < size; ++c) {
      for (Index k = 0; k < kCount; ++k) {
        total[k] += coefficients[c] * load(x + c * kGroup)[k];
      }
    }
    for (Index k = 0; k < kCount; ++k) {
      sum[k] = total[k];
    }
  }

  SYMKIN_INLINE bool all_zero(const Lanes* sums) {
    const auto zeros = [&](Index k) { return sums[k] == Lanes{}; };
    auto all = zeros(0);
    for (Index k = 1; k < kParts; ++k) {
      all &= zeros(k);
    }
    for (Index lane = 0; lane < kLanes; ++lane) {
      if (all[lane] == 0) {
        return false;
      }
    }
    return true;
  }

  // Of a group.
  SYMKIN_INLINE double largest(const double* values) {
    Lanes most = load(values)[0];
    for (Index k = 1; k < kParts; ++k) {
      most = load(values)[k] > most ? load(values)[k] : most;
    }
    alignas(64) double each[kLanes];
    *store(each) = most;
    for (Index half = kLanes / 2; half > 0; half /= 2) {  // each step waits for the one before
      for (Index k = 0; k < half; ++k) {
        each[k] = each[k + half] > each[k] ? each[k + half] : each[k];
      }
    }
    return each[0];
  }

  static void find_largest(const double* values, double* of_groups, Index groups) {
    for (Index g = 0; g < groups; ++g) {
      of_groups[g] = largest(values + g * kGroup);
    }
  }

  // sums[k * kStep + part] = sum over `size` columns of u[k * stride + c] * column c: each column
  // is loaded once for all k.
  template <Index kMany, Index kCount, Index kStep>
  SYMKIN_INLINE void combine_many(const double* x, const double* u, Index stride, Index size,
                                  Lanes* sums) {
    Lanes total[kMany][kCount] = {};
    for (Index c = 0; c < size; ++c) {
      for (Index part = 0; part < kCount; ++part) {
        const Lanes column = load(x + c * kGroup)[part];
        for (Index k = 0; k < kMany; ++k) {
          total[k][part] += u[k * stride + c] * column;
        }
      }
    }
    for (Index k = 0; k < kMany; ++k) {
      for (Index part = 0; part < kCount; ++part) {
        sums[k * kStep + part] = total[k][part];
      }
    }
  }

  // Where a vector has values: a leg of a whole mechanism has parameters of its own alone.
  static Span span_of(const Squares& squares, Index k) {
    const double* u = squares.u + k * squares.size;
    Span span{0, squares.triangular ? k + 1 : squares.size};
    while (span.first < span.end && u[span.first] == 0) {
      ++span.first;
    }
    while (span.first < span.end && u[span.end - 1] == 0) {
      --span.end;
    }
    return span;
  }

  // x u for the rows of a group, v[row][k][part], of one u or of kTogether.
  SYMKIN_INLINE void multiply(const double* x, Shape shape, const Squares& squares, Index k,
                              Index count, Span span, Lanes* v) {
    for (Index row = 0; row < shape.rows; ++row) {
      const double* from = x + (row * shape.parameters + span.first) * kGroup;
      const double* u = squares.u + k * squares.size + span.first;
      Lanes* of_row = v + row * kTogether * kParts;
      if (count == 1) {
        combine<kParts>(from, u, span.size(), of_row);
        continue;
      }
      for (Index part = 0; part < kParts; part += kStrip) {
        combine_many<kTogether, kStrip, kParts>(from + part * kLanes, u, squares.size, span.size(),
                                                of_row + part);
      }
    }
  }

  // v[row][k] is that of one u.
  SYMKIN_INLINE void add_square(const Lanes* v, Shape shape, double scale, double* gram,
                                double* trace) {
    for (Index row = 0; row < shape.rows; ++row) {
      const Lanes* of_row = v + row * kTogether * kParts;
      if (all_zero(of_row)) {  // a row of another leg
        continue;
      }
      for (Index k = 0; k < kParts; ++k) {
        store(trace)[k] += scale * (of_row[k] * of_row[k]);
      }
      for (Index other = 0; other <= row && gram != nullptr; ++other) {
        Lanes* to = store(gram + (row * (row + 1) / 2 + other) * kBlock);
        for (Index k = 0; k < kParts; ++k) {
          to[k] += scale * (of_row[k] * v[other * kTogether * kParts + k]);
        }
      }
    }
  }

  // Whether it pays to take kTogether vectors from k on at once, over the span of all, which is
  // then `span`: not of different legs, and not of a triangle's first rows.
  static bool together(const Squares& squares, Index k, Span& span) {
    if (squares.count - k < kTogether || (squares.triangular && k < kTogether)) {
      return false;
    }
    Span all = span;
    Index values = 0;
    for (Index other = k; other < k + kTogether; ++other) {
      const Span own = span_of(squares, other);
      all = {std::min(all.first, own.first), std::max(all.end, own.end)};
      values += own.size();
    }
    const bool pays = 4 * values >= 3 * kTogether * all.size();
    span = pays ? all : span;
    return pays;
  }

  static void add_squares(const double* x, Shape shape, const Squares& squares, double* gram,
                          double* trace) {
    Lanes v[kMaxRows * kTogether * kParts];
    for (Index k = 0, count = 1; k < squares.count; k += count) {
      Span span = span_of(squares, k);
      count = together(squares, k, span) ? kTogether : 1;
      for (Index lane = 0; lane < kBlock; lane += kGroup) {
        multiply(x + lane * shape.width(), shape, squares, k, count, span, v);
        for (Index i = 0; i < count; ++i) {
          add_square(v + i * kParts, shape, squares.scale == nullptr ? 1 : squares.scale[k + i],
                     gram == nullptr ? nullptr : gram + lane, trace + lane);
        }
      }
    }
  }

  // kMany vectors at once, of the rows of a group.
  template <Index kMany>
  SYMKIN_INLINE void add_squares_of_rows(const double* x, const RowForm& form, const double* u,
                                         Index stride, Span span, const double* scale, double* to) {
    Lanes v[kMaxRows][kMany][kStrip];  // of G
    for (Index part = 0; part < kParts; part += kStrip) {
      const double* from = x + part * kLanes;
      const double* factors = x + part * kLanes + form.factors * kGroup;
      Index touched = form.rows;  // the first row of G for which there is anything
      for (Index row = 0; row < form.rows; ++row) {
        const Span own = form.spans[row];
        const Index first = std::max(span.first, own.first);
        const Index end = std::min(span.end, own.end);
        touched = first < end ? std::min(touched, row) : touched;
        Lanes sums[kMany][kStrip] = {};
        for (Index c = first; c < end; ++c) {
          for (Index strip = 0; strip < kStrip; ++strip) {
            const Lanes column = load(from + (c - own.first) * kGroup)[strip];
            for (Index k = 0; k < kMany; ++k) {
              sums[k][strip] += u[k * stride + c] * column;
            }
          }
        }
        from += own.size() * kGroup;
        if (touched > row) {
          continue;
        }
        if (form.mixed) {
          for (Index k = 0; k < kMany; ++k) {
            for (Index strip = 0; strip < kStrip; ++strip) {
              v[row][k][strip] = sums[k][strip];
            }
          }
          const double* of_row = factors + row * (row - 1) / 2 * kGroup;
          for (Index other = touched; other < row; ++other) {
            for (Index strip = 0; strip < kStrip; ++strip) {
              const Lanes factor = load(of_row + other * kGroup)[strip];
              for (Index k = 0; k < kMany; ++k) {
                sums[k][strip] += factor * v[other][k][strip];
              }
            }
          }
        }
        for (Index strip = 0; strip < kStrip; ++strip) {
          Lanes sum = load(to + row * kBlock)[part + strip];
          for (Index k = 0; k < kMany; ++k) {
            sum += (scale == nullptr ? 1 : scale[k]) * (sums[k][strip] * sums[k][strip]);
          }
          store(to + row * kBlock)[part + strip] = sum;
        }
      }
    }
  }

  static void add_row_squares(const double* x, const RowForm& form, const Squares& squares,
                              double* of_rows) {
    for (Index k = 0, count = 1; k < squares.count; k += count) {
      Span span = span_of(squares, k);
      count = together(squares, k, span) ? kTogether : 1;
      const double* u = squares.u + k * squares.size;
      const double* scale = squares.scale == nullptr ? nullptr : squares.scale + k;
      for (Index lane = 0; lane < kBlock; lane += kGroup) {
        const double* group = x + lane * form.width;
        if (count == 1) {
          add_squares_of_rows<1>(group, form, u, squares.size, span, scale, of_rows + lane);
        } else {
          add_squares_of_rows<kTogether>(group, form, u, squares.size, span, scale, of_rows + lane);
        }
      }
    }
  }

  static void find_largest_products(const double* of_rows, Index rows, double* of_groups) {
    for (Index g = 0; g < kGroups; ++g) {
      alignas(64) double products[kGroup];
      for (Index k = 0; k < kParts; ++k) {
        Lanes product = Lanes{} + 1.0;
        for (Index row = 0; row < rows; ++row) {
          product *= 1.0 + load(of_rows + row * kBlock + g * kGroup)[k];
        }
        store(products)[k] = product;
      }
      of_groups[g] = largest(products);
    }
  }

  // det(I + D_jj + E S E^T) by Cholesky pivots, D_jj at `gram`.
  SYMKIN_INLINE void bordered_determinant(const double* gram, const Lanes* e, const double* s,
                                          Index r, Lanes* determinant) {
    Lanes work[kMaxRows * kMaxRows];  // L D below the diagonal of LDL^T, and D on it
    *determinant = Lanes{} + 1.0;
    for (Index a = 0; a < r; ++a) {
      Lanes es[kMaxRows];
      for (Index c = 0; c < r; ++c) {
        Lanes sum{};
        for (Index d = 0; d < r; ++d) {
          sum += s[d * r + c] * e[a * r + d];
        }
        es[c] = sum;
      }
      for (Index b = 0; b <= a; ++b) {
        Lanes value = *load(gram + (a * (a + 1) / 2 + b) * kBlock) + (a == b ? 1.0 : 0.0);
        for (Index c = 0; c < r; ++c) {
          value += es[c] * e[b * r + c];
        }
        for (Index c = 0; c < b; ++c) {
          value -= work[a * r + c] * work[b * r + c] / work[c * r + c];
        }
        work[a * r + b] = value;
      }
      *determinant *= work[a * r + a];
    }
  }

  static double find_ratios(const double* x, Shape shape, const double* gram, const double* trace,
                            LeavingRows leaving, double* ratios) {
    const Index r = shape.rows;
    const Index p = shape.parameters;
    const double* y = leaving.y;
    Lanes cross[kMaxRows * kMaxRows];
    if (r == 1) {
      combine<kParts>(x, y, p, cross);
    }
    for (Index k = 0; k < kParts; ++k) {
      const Lanes d = load(trace)[k];
      Lanes ratio;
      if (r == 1) {
        ratio = (1 + d) * leaving.base + cross[k] * cross[k];
      } else {
        for (Index row = 0; row < r; ++row) {
          const double* from = x + row * p * kGroup + kLanes * k;
          Index other = 0;
          for (; other + 3 <= r; other += 3) {
            combine_many<3, 1, 1>(from, y + other * p, p, p, cross + row * r + other);
          }
          for (; other < r; ++other) {
            combine<1>(from, y + other * p, p, cross + row * r + other);
          }
        }
        bordered_determinant(gram + kLanes * k, cross, leaving.s, r, &ratio);
        ratio *= leaving.base;
      }
      store(ratios)[k] = d >= 0.0 ? ratio : Lanes{};
    }
    return largest(ratios);
  }
};

constexpr ProductKernels kWide{Wide::find_largest, Wide::add_squares, Wide::add_row_squares,
                               Wide::find_largest_products, Wide::find_ratios};

}  // namespace

#if defined(SYMKIN_COMPILES_AVX512)
ProductKernels product_kernels_avx512() { return kWide; }
#elif defined(SYMKIN_COMPILES_AVX2)
ProductKernels product_kernels_avx2() { return kWide; }
#else
#ifdef SYMKIN_HAS_AVX2
ProductKernels product_kernels_avx2();
#endif
#ifdef SYMKIN_HAS_AVX512
ProductKernels product_kernels_avx512();
#endif

const ProductKernels& product_kernels() {
  static const ProductKernels kernels = [] {
#ifdef SYMKIN_HAS_AVX512
    if (processor_has(Processor::avx512)) {
      return product_kernels_avx512();
    }
#endif
#ifdef SYMKIN_HAS_AVX2
    if (processor_has(Processor::avx2)) {
      return product_kernels_avx2();
    }
#endif
    return kWide;
  }();
  return kernels;
}
#endif

}  // namespace symkin::design::detail
