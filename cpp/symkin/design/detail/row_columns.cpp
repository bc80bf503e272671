// SPDX-License-Identifier: MIT
#include "symkin/design/detail/row_columns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace symkin::design::detail {
namespace {

constexpr Index kLookedAt = 64;  // candidates, for the form of all
// Of a value: so far off are rows that were computed from such a product.
constexpr double kProductRounding = 16 * std::numeric_limits<double>::epsilon();

}  // namespace

RowColumns::RowColumns(const Candidates& candidates, const Indices& which) {
  const Shape shape = candidates.shape();
  const auto last = which.begin() + std::min(kLookedAt, size_of(which));
  find_form(candidates.rows({which.begin(), last}), shape);
  if (!put_all(candidates, which)) {
    spans_.assign(static_cast<std::size_t>(shape.rows), {0, shape.parameters});
    mixed_ = false;
    whole_ = true;
    put_all(candidates, which);
  }
}

// Each column belongs to the first row that has a value in it.
void RowColumns::find_form(const RowMatrix& some, Shape shape) {
  spans_.assign(static_cast<std::size_t>(shape.rows), {0, 0});
  Index owner = 0;
  for (Index column = 0; column < shape.parameters; ++column) {
    Index first = shape.rows;
    Index last = 0;
    for (Index i = 0; i < some.rows(); ++i) {
      if (some(i, column) != 0) {
        first = std::min(first, i % shape.rows);
        last = std::max(last, i % shape.rows);
      }
    }
    owner = first < shape.rows ? first : owner;
    mixed_ = mixed_ || last > first;
    Span& span = at(spans_, owner);
    span = {span.size() == 0 ? column : span.first, column + 1};
  }
}

bool RowColumns::put_all(const Candidates& candidates, const Indices& which) {
  const Shape shape = candidates.shape();
  factors_ = 0;
  for (const Span& span : spans_) {
    factors_ += span.size();
  }
  const Index width = factors_ + (mixed_ ? shape.gram_size() - shape.rows : 0);
  columns_ = ColumnBlocks(size_of(which), {1, width});
  values_.resize(static_cast<std::size_t>(width));
  std::vector<double> rows(static_cast<std::size_t>(shape.width()));
  for (Index place = 0; place < size_of(which); ++place) {
    candidates.read(at(which, place), rows.data());
    if (!put(place, rows.data(), shape)) {
      return false;
    }
  }
  return true;
}

// Whether the rows have this form.
bool RowColumns::put(Index place, const double* rows, Shape shape) {
  double* value = values_.data();
  double* factors = values_.data() + factors_;
  for (Index b = 0; b < shape.rows; ++b) {
    const auto [first, end] = at(spans_, b);
    const double* own = rows + b * shape.parameters;
    value = std::copy(own + first, own + end, value);
    const double* largest = std::max_element(
        own + first, own + end, [](double x, double y) { return std::abs(x) < std::abs(y); });
    for (Index row = 0; row < shape.rows; ++row) {
      const double* other = rows + row * shape.parameters;
      double share = 0;
      if (mixed_ && row > b) {
        share = first < end && *largest != 0 ? other[largest - own] / *largest : 0;
        factors[row * (row - 1) / 2 + b] = share;
      }
      for (Index c = first; c < end && row != b && !whole_; ++c) {
        const double bound = kProductRounding * std::max(std::abs(own[c]), std::abs(other[c]));
        if (!(std::abs(other[c] - share * own[c]) <= bound)) {
          return false;
        }
      }
    }
  }
  columns_.put(place, values_.data());
  return true;
}

RowMatrix RowColumns::times(Index place, const RowMatrix& factor) const {
  Vector values(columns_.shape().parameters);
  columns_.get(place, values.data());
  RowMatrix result = RowMatrix::Zero(rows(), factor.rows());
  Index value = 0;
  for (Index row = 0; row < rows(); ++row) {
    const Span span = at(spans_, row);
    const Index left = factor.rows() - span.first;  // above are zeros
    result.row(row).tail(left).noalias() =
        values.segment(value, span.size()).transpose() *
        factor.block(span.first, span.first, left, span.size()).transpose();
    value += span.size();
  }
  for (Index row = rows() - 1; mixed_ && row > 0; --row) {
    result.row(row) +=
        values.segment(factors_ + row * (row - 1) / 2, row).transpose() * result.topRows(row);
  }
  return result;
}

}  // namespace symkin::design::detail
