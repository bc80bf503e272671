// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/design/detail/criteria.hpp"
#include "symkin/design/detail/search.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kGain = 1e-10;    // of the merit that counts as better
constexpr Index kPromising = 400;  // pairs tried when not thorough
constexpr double kRidge = 1e-10;   // of the diagonal, where the others are singular

struct Pair {
  Index place;
  Index member;
  double gain;  // of the merit, to first order
};

}  // namespace

CriterionSearch::CriterionSearch(const Problem& problem, Indices pool, const Indices& chosen)
    : PoolSearch(problem, std::move(pool), chosen),
      rows_(problem.candidates.gather(pool_)),
      spread_(rows_),
      weighted_(rows_) {
  rebuild();
}

void CriterionSearch::rebuild() {
  information_ = problem_.fixed;
  for (const Index member : chosen_) {
    const RowMatrix c = rows_.rows(member);
    information_ += c.transpose() * c;
  }
  merit_ = criterion_merit(information_, problem_.options);
}

void CriterionSearch::exchange(Index place, Index member) {
  at(chosen_, place) = member;
  ++exchanges_;
  rebuild();
}

RowMatrix CriterionSearch::without(Index place) const {
  const RowMatrix c = rows_.rows(at(chosen_, place));
  RowMatrix rest = information_ - c.transpose() * c;
  rest.diagonal() += kRidge * information_.diagonal();
  return rest;
}

// With A the inverse of M without pose i and Q = A B A, pose j instead of i makes the expected
// error trace(A B) - trace((I + C_j A C_j^T)^-1 C_j Q C_j^T).
bool CriterionSearch::improve_error() {
  const RowMatrix& weight = problem_.options.error_weight;
  const Index r = rows_.shape().rows;
  double best = std::exp(-merit_) * (1 - kGain);
  Pair found{0, -1, 0};
  for (Index place = 0; place < size_of(chosen_); ++place) {
    check_interrupt();
    const RowMatrix factor = inverse_factor(without(place));
    if (factor.size() == 0) {
      continue;
    }
    const RowMatrix a = factor.transpose() * factor;
    const double error = (a * weight).trace();
    spread_.compute(factor);
    weighted_.compute(lower_root(a * weight * a));
    for (Index j = 0; j < rows_.count(); ++j) {
      const double reduction =
          r == 1 ? weighted_.trace(j) / (1 + spread_.trace(j))
                 : (inverse(RowMatrix::Identity(r, r) + spread_.of(j)) * weighted_.of(j)).trace();
      if (error - reduction < best && allowed(place, j)) {
        best = error - reduction;
        found = {place, j, 0};
      }
    }
  }
  if (found.member < 0) {
    return false;
  }
  const double before = merit_;
  const Index left = at(chosen_, found.place);
  exchange(found.place, found.member);
  if (merit_ <= before) {  // the ridge or rounding promised too much
    exchange(found.place, left);
    exchanges_ -= 2;
    return false;
  }
  return true;
}

// The criterion of each pair is found by its eigenvalues, the most promising to first order first.
bool CriterionSearch::improve_eigenvalues(bool thorough) {
  const RowMatrix gradient = criterion_gradient(information_, problem_.options).total();
  Vector values(rows_.count());
  for (Index j = 0; j < values.size(); ++j) {
    const RowMatrix c = rows_.rows(j);
    values[j] = (c * gradient).cwiseProduct(c).sum();
  }
  std::vector<Pair> pairs;
  for (Index place = 0; place < size_of(chosen_); ++place) {
    for (Index j = 0; j < values.size(); ++j) {
      pairs.push_back({place, j, values[j] - values[at(chosen_, place)]});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.gain > b.gain; });
  double best = merit_ + kGain;
  const Pair* best_pair = nullptr;
  Index tried = 0;
  for (const Pair& pair : pairs) {
    if (tried >= kPromising && (best_pair != nullptr || !thorough)) {
      break;
    }
    if (!allowed(pair.place, pair.member)) {
      continue;
    }
    ++tried;
    check_interrupt();
    const RowMatrix in = rows_.rows(pair.member);
    const RowMatrix out = rows_.rows(at(chosen_, pair.place));
    const double merit = criterion_merit(information_ + in.transpose() * in - out.transpose() * out,
                                         problem_.options);
    if (merit > best) {
      best = merit;
      best_pair = &pair;
    }
  }
  if (best_pair != nullptr) {
    exchange(best_pair->place, best_pair->member);
  }
  return best_pair != nullptr;
}

bool CriterionSearch::improve(bool thorough) {
  const bool error = problem_.options.criterion == Criterion::expected_error;
  return error ? improve_error() : improve_eigenvalues(thorough);
}

void CriterionSearch::descend(double /*known*/) {
  while (improve(false)) {
  }
}

void CriterionSearch::descend_thoroughly() {
  while (improve(true)) {
  }
}

}  // namespace symkin::design::detail
