// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

#include "symkin/model/leg_kernels.hpp"

namespace symkin::detail {

// A value a leg, made from the leg's. Those of a usual robot stand in place: forward kinematics
// must not allocate where a controller calls it.
template <typename T>
class PerLeg {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  template <typename Make>
  PerLeg(LegSpan legs, const Make& make) : size_(static_cast<std::size_t>(legs.count)) {
    Place* places = in_place_;
    if (size_ > kInPlace) {
      elsewhere_.reset(new Place[size_]);
      places = elsewhere_.get();
    }
    for (std::size_t i = 0; i < size_; ++i) {
      T* const made = ::new (static_cast<void*>(places + i)) T(make(legs.legs[i]));
      first_ = i == 0 ? made : first_;
    }
  }
  PerLeg(const PerLeg&) = delete;
  PerLeg& operator=(const PerLeg&) = delete;

  std::size_t size() const { return size_; }
  T* begin() { return first_; }
  T* end() { return first_ + size_; }
  const T* begin() const { return first_; }
  const T* end() const { return first_ + size_; }
  const T& operator[](std::size_t i) const { return first_[i]; }

 private:
  static constexpr std::size_t kInPlace = 8;
  struct alignas(T) Place {
    std::byte bytes[sizeof(T)];
  };

  std::size_t size_;
  T* first_ = nullptr;
  Place in_place_[kInPlace];
  std::unique_ptr<Place[]> elsewhere_;
};

}  // namespace symkin::detail
