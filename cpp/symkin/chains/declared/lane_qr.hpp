// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "symkin/model/lanes.hpp"

namespace symkin::declared {

// PivotedQr of several matrices side by side, a lane each, whose columns are independent: they are
// taken in order, since lanes would choose differently.
template <typename T, int kMostRows, int kMostColumns>
class LaneQr {
  using Mask = typename Lanes<T>::Mask;

 public:
  LaneQr(int rows, int rank) : rows_(rows), rank_(rank) {}
  int rank() const { return rank_; }

  // Of the chosen columns.
  void factorise(const T (*columns)[kMostRows], const int* chosen) {
    for (int i = 0; i < rank_; ++i) {
      for (int row = 0; row < rows_; ++row) {
        mirrors_[i][row] = columns[chosen[i]][row];
      }
    }
    using std::sqrt;
    for (int k = 0; k < rank_; ++k) {
      T* const mirror = mirrors_[k];
      for (int i = 0; i < k; ++i) {
        reflect(i, mirror);
        upper_[k][i] = mirror[i];
      }
      T square = mirror[k] * mirror[k];
      for (int row = k + 1; row < rows_; ++row) {
        square = square + mirror[row] * mirror[row];
      }
      const T first = mirror[k];
      const T size = sqrt(square);
      diagonal_[k] = Lanes<T>::select(first > T(0.0), -size, size);
      mirror[k] = first - diagonal_[k];
      scale_[k] = T(1.0) / (square - diagonal_[k] * first);
    }
  }

  // Where the mask is set, those of another.
  void take(const Mask& mask, const LaneQr& other) {
    const auto choose = [&](T& own, const T& others) { own = Lanes<T>::select(mask, others, own); };
    for (int k = 0; k < rank_; ++k) {
      for (int row = k; row < rows_; ++row) {
        choose(mirrors_[k][row], other.mirrors_[k][row]);
      }
      for (int i = 0; i < k; ++i) {
        choose(upper_[k][i], other.upper_[k][i]);
      }
      choose(diagonal_[k], other.diagonal_[k]);
      choose(scale_[k], other.scale_[k]);
    }
  }

  // The sign of the determinant of the columns and the complement.
  T orientation() const {
    T sign(1.0);
    for (int k = 0; k < rank_; ++k) {
      sign = Lanes<T>::select(diagonal_[k] > T(0.0), -sign, sign);
    }
    return sign;
  }

  // Equations become what the columns must be multiplied by to give them, as far as they reach.
  void solve(T* equations) const {
    for (int k = 0; k < rank_; ++k) {
      reflect(k, equations);
    }
    for (int k = rank_; k-- > 0;) {
      for (int i = k + 1; i < rank_; ++i) {
        equations[k] = equations[k] - upper_[i][k] * equations[i];
      }
      equations[k] = equations[k] / diagonal_[k];
    }
  }

  // The i-th unit vector square to all columns.
  void complement(int i, T* vector) const {
    for (int row = 0; row < rows_; ++row) {
      vector[row] = T(row == rank_ + i ? 1.0 : 0.0);
    }
    for (int k = rank_; k-- > 0;) {
      reflect(k, vector);
    }
  }

 private:
  // A mirror is zero above its own row.
  void reflect(int k, T* values) const {
    const T* const mirror = mirrors_[k];
    T sum = mirror[k] * values[k];
    for (int row = k + 1; row < rows_; ++row) {
      sum = sum + mirror[row] * values[row];
    }
    sum = sum * scale_[k];
    for (int row = k; row < rows_; ++row) {
      values[row] = values[row] - sum * mirror[row];
    }
  }

  int rows_, rank_;
  T mirrors_[kMostColumns][kMostRows], upper_[kMostColumns][kMostColumns];
  T diagonal_[kMostColumns], scale_[kMostColumns];
};

}  // namespace symkin::declared
