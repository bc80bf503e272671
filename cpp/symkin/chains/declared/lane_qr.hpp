// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "symkin/chains/declared/lane_leg.hpp"
#include "symkin/model/lanes.hpp"

namespace symkin::declared {

// PivotedQr of several matrices side by side, a lane each, whose columns are independent: they are
// taken in an order that is known before, since lanes would choose differently.
template <typename T, int kMostRows, int kMostColumns>
class LaneQr {
  using Mask = typename Lanes<T>::Mask;

 public:
  explicit LaneQr(const Elimination& order) : order_(order) {}
  int rank() const { return order_.rank; }
  int column(int i) const { return order_.mirrors[i].column; }

  void factorise(const T (*columns)[kMostRows]) {
    using std::sqrt;
    for (int k = 0; k < rank(); ++k) {
      const Elimination::Mirror& order = order_.mirrors[k];
      const T* const column = columns[order.column];
      T* const mirror = mirrors_[k];
      for (int i = 0; i < order.row_count; ++i) {
        mirror[order.rows[i]] = column[order.rows[i]];
      }
      for (int i = 0; i < order.earlier_count; ++i) {
        const int earlier = order.earlier[i];
        reflect(earlier, mirror);
        upper_[k][earlier] = mirror[axis(earlier)];
      }
      T square(0.0);
      for (int i = 0; i < order.mirrored; ++i) {
        const T& value = mirror[order.rows[i]];
        square = i == 0 ? value * value : square + value * value;
      }
      T& first = mirror[axis(k)];
      const T size = sqrt(square);
      diagonal_[k] = Lanes<T>::select(first > T(0.0), -size, size);
      scale_[k] = T(1.0) / (square - diagonal_[k] * first);
      first = first - diagonal_[k];
    }
  }

  // Where the mask is set, those of another.
  void take(const Mask& mask, const LaneQr& other) {
    const auto choose = [&](T& own, const T& others) { own = Lanes<T>::select(mask, others, own); };
    for (int k = 0; k < rank(); ++k) {
      const Elimination::Mirror& order = order_.mirrors[k];
      for (int i = 0; i < order.mirrored; ++i) {
        choose(mirrors_[k][order.rows[i]], other.mirrors_[k][order.rows[i]]);
      }
      for (int i = 0; i < order.earlier_count; ++i) {
        choose(upper_[k][order.earlier[i]], other.upper_[k][order.earlier[i]]);
      }
      choose(diagonal_[k], other.diagonal_[k]);
      choose(scale_[k], other.scale_[k]);
    }
  }

  // The sign of the determinant of the columns, as the joints come, and the complement.
  T orientation() const {
    T sign(order_.sign);
    for (int k = 0; k < rank(); ++k) {
      sign = Lanes<T>::select(diagonal_[k] > T(0.0), -sign, sign);
    }
    return sign;
  }

  // What the columns must be multiplied by to give the equations, as far as they reach; of these
  // nothing is left.
  void solve(T* equations, T* solution) const {
    for (int k = 0; k < rank(); ++k) {
      reflect(k, equations);
    }
    for (int k = rank(); k-- > 0;) {
      const Elimination::Mirror& order = order_.mirrors[k];
      solution[k] = equations[axis(k)] / diagonal_[k];
      for (int i = 0; i < order.earlier_count; ++i) {
        T& left = equations[axis(order.earlier[i])];
        left = left - upper_[k][order.earlier[i]] * solution[k];
      }
    }
  }

  // The i-th unit vector square to all columns.
  void complement(int i, int rows, T* vector) const {
    for (int row = 0; row < rows; ++row) {
      vector[row] = T(row == order_.left[i] ? 1.0 : 0.0);
    }
    for (int k = rank(); k-- > 0;) {
      reflect(k, vector);
    }
  }

 private:
  int axis(int k) const { return order_.mirrors[k].rows[0]; }

  void reflect(int k, T* values) const {
    const Elimination::Mirror& order = order_.mirrors[k];
    const T* const mirror = mirrors_[k];
    T sum = mirror[order.rows[0]] * values[order.rows[0]];
    for (int i = 1; i < order.mirrored; ++i) {
      sum = sum + mirror[order.rows[i]] * values[order.rows[i]];
    }
    sum = sum * scale_[k];
    for (int i = 0; i < order.mirrored; ++i) {
      T& value = values[order.rows[i]];
      value = value - sum * mirror[order.rows[i]];
    }
  }

  const Elimination& order_;
  T mirrors_[kMostColumns][kMostRows], upper_[kMostColumns][kMostColumns];
  T diagonal_[kMostColumns], scale_[kMostColumns];
};

}  // namespace symkin::declared
