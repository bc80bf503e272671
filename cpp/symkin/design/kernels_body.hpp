// SPDX-License-Identifier: MIT
#pragma once

// The bodies of the kernels, compiled once for every instruction set by kernels.cpp. Explicit wide
// arithmetic: eight lanes a value, four values a group, so that each coefficient is loaded once for
// 32 candidates. Nothing here may be called from elsewhere.

#include <algorithm>
#include <cmath>

#include "symkin/design/kernels.hpp"

#define SYMKIN_INLINE [[gnu::always_inline]] inline

namespace symkin::body {

using Lanes [[gnu::vector_size(64), gnu::may_alias]] = double;
constexpr Index kWidth = 8;
constexpr Index kParts = kGroup / kWidth;

SYMKIN_INLINE const Lanes* load(const double* address) {
  return reinterpret_cast<const Lanes*>(address);
}
SYMKIN_INLINE Lanes* store(double* address) { return reinterpret_cast<Lanes*>(address); }

// Of one group.
SYMKIN_INLINE double largest(const double* values) {
  const Lanes* v = load(values);
  const Lanes low = v[0] > v[1] ? v[0] : v[1];
  const Lanes high = v[2] > v[3] ? v[2] : v[3];
  alignas(64) double m[kWidth];
  *store(m) = low > high ? low : high;
  return std::max(std::max(std::max(m[0], m[1]), std::max(m[2], m[3])),
                  std::max(std::max(m[4], m[5]), std::max(m[6], m[7])));
}

// sum[k] = sum over `size` columns of coefficient[c] * column c.
SYMKIN_INLINE void combine(const double* x, const double* coefficients, Index size, Lanes* sum) {
  Lanes s0{}, s1{}, s2{}, s3{};
  for (Index c = 0; c < size; ++c) {
    const Lanes* column = load(x + c * kBlock);
    const double k = coefficients[c];
    s0 += k * column[0];
    s1 += k * column[1];
    s2 += k * column[2];
    s3 += k * column[3];
  }
  sum[0] = s0;
  sum[1] = s1;
  sum[2] = s2;
  sum[3] = s3;
}

SYMKIN_INLINE void transform(const double* x, const double* t, Shape shape, double* z) {
  const Index p = shape.parameters;
  for (Index row = 0; row < shape.rows; ++row) {
    for (Index g = 0; g < kBlock; g += kGroup) {
      for (Index a = 0; a < p; ++a) {
        combine(x + row * p * kBlock + g, t + a * p, a + 1, store(z + (row * p + a) * kBlock + g));
      }
    }
  }
}

SYMKIN_INLINE void variance(const double* x, const double* t, Shape shape, double* trace,
                            double* group_max) {
  const Index p = shape.parameters;
  for (Index g = 0; g < kBlock; g += kGroup) {
    Lanes sum[kParts] = {};
    for (Index row = 0; row < shape.rows; ++row) {
      for (Index a = 0; a < p; ++a) {
        Lanes z[kParts];
        combine(x + row * p * kBlock + g, t + a * p, a + 1, z);
        for (Index k = 0; k < kParts; ++k) {
          sum[k] += z[k] * z[k];
        }
      }
    }
    for (Index k = 0; k < kParts; ++k) {
      store(trace + g)[k] = sum[k];
    }
    group_max[g / kGroup] = largest(trace + g);
  }
}

// Traces and their maxima from the gram columns.
SYMKIN_INLINE void summarise(const double* gram, Shape shape, double* trace, double* group_max) {
  for (Index g = 0; g < kBlock; g += kGroup) {
    for (Index k = 0; k < kParts; ++k) {
      Lanes sum{};
      for (Index row = 0; row < shape.rows; ++row) {
        sum += load(gram + (row * (row + 3) / 2) * kBlock + g)[k];
      }
      store(trace + g)[k] = sum;
    }
    group_max[g / kGroup] = largest(trace + g);
  }
}

SYMKIN_INLINE void gram(const double* x, const double* t, Shape shape, double* gram_columns,
                        double* trace, double* group_max) {
  const Index p = shape.parameters;
  if (shape.rows == 1) {
    variance(x, t, shape, trace, group_max);
    return;
  }
  // One column of z at a time; every pair of rows takes its product.
  for (Index g = 0; g < kBlock; g += kGroup) {
    Lanes z[kMaxRows * kParts];
    for (Index a = 0; a < p; ++a) {
      for (Index row = 0; row < shape.rows; ++row) {
        combine(x + row * p * kBlock + g, t + a * p, a + 1, z + row * kParts);
      }
      Index pair = 0;
      for (Index row = 0; row < shape.rows; ++row) {
        for (Index other = 0; other <= row; ++other, ++pair) {
          Lanes* sum = store(gram_columns + pair * kBlock + g);
          for (Index k = 0; k < kParts; ++k) {
            const Lanes product = z[row * kParts + k] * z[other * kParts + k];
            sum[k] = a == 0 ? product : sum[k] + product;
          }
        }
      }
    }
  }
  summarise(gram_columns, shape, trace, group_max);
}

SYMKIN_INLINE void gram_update(const double* x, const double* u, double scale, Shape shape,
                               double* gram_columns, double* trace, double* group_max) {
  const Index p = shape.parameters;
  if (shape.rows == 1) {
    for (Index g = 0; g < kBlock; g += kGroup) {
      Lanes v[kParts];
      combine(x + g, u, p, v);
      for (Index k = 0; k < kParts; ++k) {
        store(trace + g)[k] += scale * (v[k] * v[k]);
      }
      group_max[g / kGroup] = largest(trace + g);
    }
    return;
  }
  for (Index g = 0; g < kBlock; g += kGroup) {
    Lanes v[kMaxRows * kParts];
    for (Index row = 0; row < shape.rows; ++row) {
      combine(x + row * p * kBlock + g, u, p, v + row * kParts);
    }
    Index pair = 0;
    for (Index row = 0; row < shape.rows; ++row) {
      for (Index other = 0; other <= row; ++other, ++pair) {
        for (Index k = 0; k < kParts; ++k) {
          store(gram_columns + pair * kBlock + g)[k] +=
              scale * (v[row * kParts + k] * v[other * kParts + k]);
        }
      }
    }
  }
  summarise(gram_columns, shape, trace, group_max);
}

SYMKIN_INLINE void outer_sum(const double* x, Shape shape, double* sum) {
  const Index p = shape.parameters;
  for (Index row = 0; row < shape.rows; ++row) {
    const double* columns = x + row * p * kBlock;
    for (Index a = 0; a < p; ++a) {
      for (Index b = 0; b <= a; ++b) {
        const Lanes* left = load(columns + a * kBlock);
        const Lanes* right = load(columns + b * kBlock);
        Lanes total[kParts] = {};
        for (Index g = 0; g < kBlock / kWidth; g += kParts) {
          for (Index k = 0; k < kParts; ++k) {
            total[k] += left[g + k] * right[g + k];
          }
        }
        const Lanes folded = (total[0] + total[1]) + (total[2] + total[3]);
        sum[a * p + b] += ((folded[0] + folded[1]) + (folded[2] + folded[3])) +
                          ((folded[4] + folded[5]) + (folded[6] + folded[7]));
      }
    }
  }
}

// The largest ratio of the group, if it beats the best.
SYMKIN_INLINE void take_best(const double* ratios, Index first, Index count, BestPair& best) {
  for (Index lane = 0; lane < count; ++lane) {
    if (ratios[lane] > best.ratio) {
      best.ratio = ratios[lane];
      best.lane = first + lane;
    }
  }
}

// (1 + d_j)(1 - d_i) + d_ij^2, never above 1 + d_j - d_i.
SYMKIN_INLINE void best_pair_single(const double* x, const double* trace, const double* group_max,
                                    const Leaving& leaving, Index p, BestPair& best) {
  alignas(64) double ratios[kGroup];
  for (Index g = 0; g < kGroups; ++g) {
    if (!(group_max[g] > best.ratio - 1 + leaving.trace)) {
      continue;
    }
    Lanes cross[kParts];
    combine(x + g * kGroup, leaving.y, p, cross);
    const Lanes* d = load(trace + g * kGroup);
    for (Index k = 0; k < kParts; ++k) {
      store(ratios)[k] = (1 + d[k]) * leaving.base + cross[k] * cross[k];
    }
    if (largest(ratios) > best.ratio) {
      take_best(ratios, g * kGroup, kGroup, best);
    }
  }
}

// det(I + D_jj + E S E^T) of eight lanes by their Cholesky pivots, D_jj at `gram`.
SYMKIN_INLINE void bordered_determinant(const double* gram_columns, const Lanes* e, const double* s,
                                        Index r, Lanes* work, Lanes& determinant) {
  determinant = Lanes{} + 1.0;
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
      Lanes value = load(gram_columns + (a * (a + 1) / 2 + b) * kBlock)[0] + (a == b ? 1.0 : 0.0);
      for (Index c = 0; c < r; ++c) {
        value += es[c] * e[b * r + c];
      }
      // LDL^T: `work` holds L D below the diagonal and D on it.
      for (Index c = 0; c < b; ++c) {
        value -= work[a * r + c] * work[b * r + c] / work[c * r + c];
      }
      work[a * r + b] = value;
    }
    determinant *= work[a * r + a];
  }
}

// With A = I + Z, Z of rank 2 r at most and trace d_j - d_i: det A <= (1 + (d_j - d_i) / q)^q.
SYMKIN_INLINE void best_pair_block(const double* x, const double* gram_columns,
                                   const double* group_max, const Leaving& leaving, Shape shape,
                                   BestPair& best) {
  const Index r = shape.rows;
  const Index p = shape.parameters;
  const auto q = static_cast<double>(std::min(2 * r, p));
  alignas(64) double ratios[kGroup];
  Lanes cross[kMaxRows * kMaxRows];
  Lanes work[kMaxRows * kMaxRows];
  for (Index g = 0; g < kGroups; ++g) {
    if (!(group_max[g] > leaving.trace + q * (std::pow(best.ratio, 1 / q) - 1))) {
      continue;
    }
    for (Index k = 0; k < kParts; ++k) {
      const Index lane = g * kGroup + k * kWidth;
      for (Index a = 0; a < r; ++a) {
        for (Index b = 0; b < r; ++b) {
          Lanes sum{};
          for (Index c = 0; c < p; ++c) {
            sum += leaving.y[b * p + c] * load(x + (a * p + c) * kBlock + lane)[0];
          }
          cross[a * r + b] = sum;
        }
      }
      Lanes determinant;
      bordered_determinant(gram_columns + lane, cross, leaving.s, r, work, determinant);
      store(ratios)[k] = leaving.base * determinant;
    }
    take_best(ratios, g * kGroup, kGroup, best);
  }
}

SYMKIN_INLINE void best_pair(const double* x, const double* gram_columns, const double* trace,
                             const double* group_max, const Leaving& leaving, Shape shape,
                             BestPair& best) {
  if (shape.rows == 1) {
    best_pair_single(x, trace, group_max, leaving, shape.parameters, best);
  } else {
    best_pair_block(x, gram_columns, group_max, leaving, shape, best);
  }
}

}  // namespace symkin::body

#undef SYMKIN_INLINE
