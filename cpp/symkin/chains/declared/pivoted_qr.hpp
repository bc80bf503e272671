// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "symkin/chains/declared/loops.hpp"

namespace symkin::declared {

// Householder's QR with column pivoting of some columns of a small matrix, whose rank is known, so
// that it ends there. Eigen's takes three times as long for a leg's three to six equations, since
// it is made for blocks.
class PivotedQr {
 public:
  PivotedQr(const Columns& all, const std::vector<int>& chosen, int rank)
      : rows_(static_cast<std::size_t>(all.rows())), rank_(static_cast<std::size_t>(rank)) {
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      columns_[i] = &values_[i * kMostEquations];
      order_[i] = chosen[i];
      for (std::size_t row = 0; row < rows_; ++row) {
        columns_[i][row] = all(static_cast<Index>(row), chosen[i]);
      }
    }
    for (std::size_t k = 0; k < rank_; ++k) {
      std::size_t largest = k;
      double square = -1;
      for (std::size_t i = k; i < chosen.size(); ++i) {
        const double own = dot(k, columns_[i], columns_[i]);
        if (own > square) {
          square = own;
          largest = i;
        }
      }
      std::swap(columns_[k], columns_[largest]);
      std::swap(order_[k], order_[largest]);
      double* const mirror = columns_[k];
      diagonal_[k] = mirror[k] > 0 ? -std::sqrt(square) : std::sqrt(square);
      const double first = mirror[k];
      mirror[k] -= diagonal_[k];
      scale_[k] = square > 0 ? 1 / (square - diagonal_[k] * first) : 0;
      for (std::size_t i = k + 1; i < chosen.size(); ++i) {
        reflect(k, columns_[i]);
      }
    }
  }

  // Which of all columns was taken as the i-th.
  int column(int i) const { return order_[static_cast<std::size_t>(i)]; }

  // What the columns taken must be multiplied by to give the part of the equations that they reach.
  Joints solve(Equations equations) const {
    for (std::size_t k = 0; k < rank_; ++k) {
      reflect(k, equations.data());
    }
    Joints solution(static_cast<Index>(rank_));
    for (std::size_t k = rank_; k-- > 0;) {
      double left = equations[static_cast<Index>(k)];
      for (std::size_t i = k + 1; i < rank_; ++i) {
        left -= columns_[i][k] * solution[static_cast<Index>(i)];
      }
      solution[static_cast<Index>(k)] = left / diagonal_[k];
    }
    return solution;
  }

  // Unit vectors, equations x (equations - rank), square to all columns.
  Columns complement() const {
    const auto rows = static_cast<Index>(rows_);
    Columns square = Columns::Identity(rows, rows).rightCols(rows - static_cast<Index>(rank_));
    for (Index i = 0; i < square.cols(); ++i) {
      for (std::size_t k = rank_; k-- > 0;) {
        reflect(k, square.col(i).data());
      }
    }
    return square;
  }

 private:
  double dot(std::size_t first, const double* a, const double* b) const {
    double sum = 0;
    for (std::size_t row = first; row < rows_; ++row) {
      sum += a[row] * b[row];
    }
    return sum;
  }

  void reflect(std::size_t k, double* values) const {
    const double share = scale_[k] * dot(k, columns_[k], values);
    for (std::size_t row = k; row < rows_; ++row) {
      values[row] -= share * columns_[k][row];
    }
  }

  std::size_t rows_, rank_;
  std::array<double, std::size_t{kMostEquations} * kMostJoints> values_;
  std::array<double*, kMostJoints> columns_;
  std::array<int, kMostJoints> order_;
  std::array<double, kMostJoints> diagonal_, scale_;
};

}  // namespace symkin::declared
