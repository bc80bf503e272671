// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/design/detail/candidates.hpp"
#include "symkin/design/detail/product_kernels.hpp"

namespace symkin::design::detail {

// Some candidates for passes that look at their rows one by one. Rows of a pose of a whole
// mechanism are mixed: each leg has parameters of its own, and the noise of the measured pose is
// common to all. For a hexapod C = W G is 63 numbers rather than 288.
class RowColumns {
 public:
  RowColumns(const Candidates& candidates, const Indices& which);

  Index count() const { return columns_.count(); }
  Index blocks() const { return columns_.blocks(); }
  Index rows() const { return size_of(spans_); }
  RowForm form() const {
    return {spans_.data(), rows(), factors_, columns_.shape().parameters, mixed_};
  }
  const double* block(Index b) const { return columns_.block(b); }

  // C T^T of one of them, T lower triangular.
  RowMatrix times(Index place, const RowMatrix& factor) const;

 private:
  void find_form(const RowMatrix& some, Shape shape);
  bool put_all(const Candidates& candidates, const Indices& which);
  bool put(Index place, const double* rows, Shape shape);

  std::vector<Span> spans_;
  bool mixed_ = false;
  bool whole_ = false;  // nothing is left out of the rows
  Index factors_ = 0;
  ColumnBlocks columns_;
  std::vector<double> values_;  // of one candidate
};

}  // namespace symkin::design::detail
