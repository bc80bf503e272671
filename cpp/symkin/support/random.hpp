// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

#include "symkin/support/types.hpp"

namespace symkin {

// std::mt19937_64 to the bit, without its branch on a random one, which processors guess wrongly
// half of the time.
class MersenneTwister {
 public:
  using result_type = std::uint64_t;
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~min(); }

  explicit MersenneTwister(result_type seed) {
    for (std::size_t i = 0; i < kSize; ++i) {
      state_[i] = seed;
      seed = 6364136223846793005U * (seed ^ (seed >> 62U)) + i + 1;
    }
  }

  result_type operator()() {
    if (next_ == kSize) {
      renew();
    }
    result_type z = state_[next_++];
    z ^= (z >> 29U) & 0x5555555555555555U;
    z ^= (z << 17U) & 0x71d67fffeda60000U;
    z ^= (z << 37U) & 0xfff7eee000000000U;
    return z ^ (z >> 43U);
  }

 private:
  static constexpr std::size_t kSize = 312;
  static constexpr std::size_t kShift = 156;

  void renew() {
    const auto renewed = [this](std::size_t i, std::size_t following, std::size_t shifted) {
      const result_type y = (state_[i] & ~kLower) | (state_[following] & kLower);
      state_[i] = state_[shifted] ^ (y >> 1U) ^ (-(y & 1U) & 0xb5026f5aa96619e9U);
    };
    for (std::size_t i = 0; i < kShift; ++i) {
      renewed(i, i + 1, i + kShift);
    }
    for (std::size_t i = kShift; i < kSize - 1; ++i) {
      renewed(i, i + 1, i - kShift);
    }
    renewed(kSize - 1, 0, kShift - 1);
    next_ = 0;
  }

  static constexpr result_type kLower = 0x7fffffff;
  std::array<result_type, kSize> state_;
  std::size_t next_ = kSize;
};

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

  MersenneTwister engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace symkin
