// SPDX-License-Identifier: MIT
#include "symkin/statistics/detail/largest_kernels.hpp"

#include "symkin/support/processor.hpp"
#include "symkin/support/registers.hpp"

namespace symkin::detail {
namespace {

using namespace registers;

// Draws side by side in a register.
struct Wide {
  // Registers of draws at once: with three rows their sums nearly fill what there are.
  static constexpr Index kParts = kLanes == 8 ? 8 : 4;

  // Adds the squares of kRows rows.
  template <Index kRows>
  SYMKIN_INLINE void add_squares(const double* row, Index columns, const double* draws,
                                 Lanes* square) {
    Lanes total[kRows][kParts] = {};
    for (Index c = 0; c < columns; ++c) {
      for (Index part = 0; part < kParts; ++part) {
        const Lanes draw = load(draws + c * kDraws)[part];
        for (Index r = 0; r < kRows; ++r) {
          total[r][part] += row[r * columns + c] * draw;
        }
      }
    }
    for (Index r = 0; r < kRows; ++r) {
      for (Index part = 0; part < kParts; ++part) {
        square[part] += total[r][part] * total[r][part];
      }
    }
  }

  static void find_largest(const double* moves, Index poses, Index rows, Index columns,
                           const double* draws, double* largest) {
    for (Index first = 0; first < kDraws; first += kParts * kLanes) {
      Lanes most[kParts] = {};
      const double* row = moves;
      for (Index pose = 0; pose < poses; ++pose) {
        Lanes square[kParts] = {};
        Index left = rows;
        for (; left >= 3; left -= 3, row += 3 * columns) {
          add_squares<3>(row, columns, draws + first, square);
        }
        for (; left > 0; --left, row += columns) {
          add_squares<1>(row, columns, draws + first, square);
        }
        for (Index part = 0; part < kParts; ++part) {
          most[part] = square[part] > most[part] ? square[part] : most[part];
        }
      }
      for (Index part = 0; part < kParts; ++part) {
        store(largest + first)[part] = most[part];
      }
    }
  }
};

}  // namespace

#if defined(SYMKIN_COMPILES_AVX512)
FindLargest find_largest_avx512() { return Wide::find_largest; }
#elif defined(SYMKIN_COMPILES_AVX2)
FindLargest find_largest_avx2() { return Wide::find_largest; }
#else
#ifdef SYMKIN_HAS_AVX2
FindLargest find_largest_avx2();
#endif
#ifdef SYMKIN_HAS_AVX512
FindLargest find_largest_avx512();
#endif

FindLargest find_largest() {
#ifdef SYMKIN_HAS_AVX512
  if (processor_has(Processor::avx512)) {
    return find_largest_avx512();
  }
#endif
#ifdef SYMKIN_HAS_AVX2
  if (processor_has(Processor::avx2)) {
    return find_largest_avx2();
  }
#endif
  return Wide::find_largest;
}
#endif

}  // namespace symkin::detail
