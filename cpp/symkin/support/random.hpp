// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>

#include "symkin/support/types.hpp"

namespace symkin {

// A seeded stream of random numbers. Work that may run on several threads takes one stream per
// block of work, so that the result does not depend on the number of threads.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : engine_(mix(seed, stream)) {}

  // Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }

  // Standard normal.
  double normal() { return normal_(engine_); }

  // Uniform in 0 .. n-1.
  Index below(Index n) { return static_cast<Index>(uniform() * static_cast<double>(n)); }

 private:
  // SplitMix64 finaliser: neighbouring seeds and streams start far apart.
  static std::uint64_t mix(std::uint64_t seed, std::uint64_t stream) {
    std::uint64_t z = seed + 0x9e3779b97f4a7c15ULL * (stream + 1);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }

  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace symkin
