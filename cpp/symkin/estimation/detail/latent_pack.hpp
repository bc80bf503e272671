// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>

#include "symkin/estimation/detail/latent_kernels.hpp"
#include "symkin/model/batched_leg.hpp"

namespace symkin::detail {

// The room of one pack.
template <typename T>
class Pack {
 public:
  Pack(const LatentRows& rows, Index pack, Index place)
      : at_(rows.room + (pack * rows.places.size + place) * Lanes<T>::kCount) {}

  T operator[](Index i) const {
    if constexpr (std::is_same_v<T, double>) {
      return at_[i];
    } else {
      return T::load_unaligned(at_ + i * Lanes<T>::kCount);
    }
  }
  void set(Index i, const T& value) const {
    if constexpr (std::is_same_v<T, double>) {
      at_[i] = value;
    } else {
      value.store_unaligned(at_ + i * Lanes<T>::kCount);
    }
  }

 private:
  double* at_;
};

template <typename T>
Index packs(const LatentRows& rows) {
  return (rows.count + Lanes<T>::kCount - 1) / Lanes<T>::kCount;
}

}  // namespace symkin::detail
