// SPDX-License-Identifier: MIT
#include "symkin/design/detail/row_variances.hpp"

#include <algorithm>
#include <utility>

#include "symkin/design/detail/product_kernels.hpp"

namespace symkin::design::detail {

RowVariances::RowVariances(const RowColumns& candidates, Index inverses)
    : x_(candidates), states_(static_cast<std::size_t>(inverses)) {
  for (State& state : states_) {
    state.of_rows = AlignedArray(x_.blocks() * x_.rows() * kBlock);
    state.largest.resize(static_cast<std::size_t>(x_.blocks() * kGroups));
  }
}

void RowVariances::compute(Index which, RowMatrix factor) {
  at(states_, which).factor = std::move(factor);
  at(states_, which).changes.clear();
}

void RowVariances::update(Index which, InverseChange change) {
  at(states_, which).changes.push_back(std::move(change));
}

void RowVariances::pass() {
  for (Index block = 0; block < x_.blocks(); ++block) {
    for (State& state : states_) {
      if (state.factor.size() != 0 || !state.changes.empty()) {
        pass(state, block);
      }
    }
  }
  for (State& state : states_) {
    state.factor.resize(0, 0);
    state.changes.clear();
  }
}

void RowVariances::pass(State& state, Index block) const {
  const ProductKernels& kernels = product_kernels();
  const Index rows = x_.rows();
  double* of_rows = state.of_rows.data() + block * rows * kBlock;
  const auto add = [&](const RowMatrix& u, bool triangular, const double* scale) {
    kernels.add_row_squares(x_.block(block), x_.form(),
                            {u.data(), u.rows(), u.cols(), triangular, scale}, of_rows);
  };
  if (state.factor.size() != 0) {
    std::fill_n(of_rows, rows * kBlock, 0.0);
    add(state.factor, true, nullptr);
  }
  for (const InverseChange& change : state.changes) {
    add(change.u, false, change.scale.data());
  }
  kernels.find_largest_products(of_rows, rows, state.largest.data() + block * kGroups);
}

double RowVariances::bound(Index which, Index candidate) const {
  const double* of_rows = at(states_, which).of_rows.data() +
                          candidate / kBlock * x_.rows() * kBlock + candidate % kBlock;
  double product = 1;
  for (Index row = 0; row < x_.rows(); ++row) {
    product *= 1 + of_rows[row * kBlock];
  }
  return product;
}

}  // namespace symkin::design::detail
