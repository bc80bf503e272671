// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "symkin/chains/declared/loops.hpp"

namespace symkin::declared {

// Householder's QR with column pivoting of some columns of a small matrix, whose rank is known, so
// that it ends there. Eigen's takes three times as long for a leg's three to six equations, since
// it is made for blocks. Where the number of equations is known to the compiler, as most are, loops
// over them are unrolled: mirrors are zero above their own row and taken in full.
class PivotedQr {
 public:
  PivotedQr(const Columns& all, const std::vector<int>& chosen, int rank)
      : rows_(static_cast<std::size_t>(all.rows())), rank_(static_cast<std::size_t>(rank)) {
    with_rows([&](auto rows) { factorise<rows>(all, chosen); });
  }

  // Whether the columns, all of which were taken, and the complement turn as the axes do: the sign
  // of their determinant in the order in which they were chosen.
  double orientation() const {
    double sign = exchanges_even_ ? 1 : -1;
    for (std::size_t k = 0; k < rank_; ++k) {
      sign = diagonal_[k] > 0 ? -sign : sign;  // and a reflection changes it
    }
    return sign;
  }

  // Which of all columns was taken as the i-th.
  int column(int i) const { return order_[static_cast<std::size_t>(i)]; }

  // What the columns taken must be multiplied by to give the part of the equations that they reach.
  Joints solve(Equations equations) const {
    with_rows([&](auto rows) {
      for (std::size_t k = 0; k < rank_; ++k) {
        reflect<rows>(k, equations.data());
      }
    });
    Joints solution(static_cast<Index>(rank_));
    for (std::size_t k = rank_; k-- > 0;) {
      double left = equations[static_cast<Index>(k)];
      for (std::size_t i = k + 1; i < rank_; ++i) {
        left -= upper_[i][k] * solution[static_cast<Index>(i)];
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
      with_rows([&](auto known) {
        for (std::size_t k = rank_; k-- > 0;) {
          reflect<known>(k, square.col(i).data());
        }
      });
    }
    return square;
  }

 private:
  static constexpr std::size_t kAny = 0;
  template <std::size_t kRows>
  using Rows = std::integral_constant<std::size_t, kRows>;
  using Column = std::array<double, kMostEquations>;

  template <typename Visit>
  void with_rows(const Visit& visit) const {
    switch (rows_) {
      case 2:
        return visit(Rows<2>());
      case 3:
        return visit(Rows<3>());
      case 5:
        return visit(Rows<5>());
      case 6:
        return visit(Rows<6>());
      default:
        return visit(Rows<kAny>());
    }
  }

  template <std::size_t kRows>
  void factorise(const Columns& all, const std::vector<int>& chosen) {
    const std::size_t rows = kRows == kAny ? rows_ : kRows;
    const std::size_t count = chosen.size();
    std::array<Column, kMostJoints> left;
    std::array<double, kMostJoints> squares;
    for (std::size_t i = 0; i < count; ++i) {
      order_[i] = chosen[i];
      const double* const from = &all(0, chosen[i]);
      for (std::size_t row = 0; row < rows; ++row) {
        left[i][row] = from[row];
      }
    }
    for (std::size_t k = 0; k < rank_; ++k) {
      std::size_t largest = k;
      for (std::size_t i = k; i < count; ++i) {
        squares[i] = dot<kRows>(left[i].data(), left[i].data());
        largest = squares[i] > squares[largest] ? i : largest;
      }
      if (largest != k) {
        std::swap(left[k], left[largest]);
        std::swap(upper_[k], upper_[largest]);
        std::swap(order_[k], order_[largest]);
        std::swap(squares[k], squares[largest]);
        exchanges_even_ = !exchanges_even_;
      }
      Column& mirror = mirrors_[k];
      mirror = left[k];
      const double first = mirror[k];
      diagonal_[k] = first > 0 ? -std::sqrt(squares[k]) : std::sqrt(squares[k]);
      mirror[k] -= diagonal_[k];
      scale_[k] = squares[k] > 0 ? 1 / (squares[k] - diagonal_[k] * first) : 0;
      for (std::size_t i = k + 1; i < count; ++i) {
        reflect<kRows>(k, left[i].data());
        upper_[i][k] = left[i][k];
        left[i][k] = 0;
      }
    }
  }

  template <std::size_t kRows>
  double dot(const double* a, const double* b) const {
    const std::size_t rows = kRows == kAny ? rows_ : kRows;
    double sum = 0;
    for (std::size_t row = 0; row < rows; ++row) {
      sum += a[row] * b[row];
    }
    return sum;
  }

  template <std::size_t kRows>
  void reflect(std::size_t k, double* values) const {
    const std::size_t rows = kRows == kAny ? rows_ : kRows;
    const double* const mirror = mirrors_[k].data();
    const double share = scale_[k] * dot<kRows>(mirror, values);
    for (std::size_t row = 0; row < rows; ++row) {
      values[row] -= share * mirror[row];
    }
  }

  std::size_t rows_, rank_;
  bool exchanges_even_ = true;
  std::array<Column, kMostJoints> mirrors_, upper_;  // upper_[i][k]: R in row k, column i
  std::array<int, kMostJoints> order_;
  std::array<double, kMostJoints> diagonal_, scale_;
};

}  // namespace symkin::declared
