// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

#include "symkin/support/types.hpp"

namespace symkin {

// Zeroed doubles that start at a cache line, as the wide loads of the kernels need.
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(Index size)
      : data_(static_cast<double*>(
            ::operator new(static_cast<std::size_t>(size) * sizeof(double), kAlignment))),
        size_(size) {
    fill(0);
  }

  AlignedArray(AlignedArray&&) noexcept = default;
  AlignedArray& operator=(AlignedArray&&) noexcept = default;
  AlignedArray(const AlignedArray& other) : AlignedArray(other.size_) {
    std::copy_n(other.data(), size_, data());
  }
  AlignedArray& operator=(const AlignedArray& other) { return *this = AlignedArray(other); }
  ~AlignedArray() = default;

  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }
  double& operator[](Index i) { return data_.get()[i]; }
  double operator[](Index i) const { return data_.get()[i]; }
  Index size() const { return size_; }
  void fill(double value) { std::fill_n(data(), size_, value); }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Release {
    void operator()(double* data) const { ::operator delete(data, kAlignment); }
  };

  std::unique_ptr<double, Release> data_;
  Index size_ = 0;
};

}  // namespace symkin
