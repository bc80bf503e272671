// SPDX-License-Identifier: MIT
#include "symkin/design/detail/search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>

#include "symkin/design/detail/criteria.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kSame = 1e-9;        // difference of a merit
constexpr Index kExchangesKept = 16;  // before everything is computed afresh
constexpr Index kPromising = 400;     // pairs of a pool that are tried
constexpr Index kFewestKicks = 4;
constexpr Index kKickEffort = 120'000;  // of all kicks: rows^2 x parameters, as an exchange costs

// By falling variance: then the kernels skip most groups by the first look at their largest.
Indices sorted_pool(const Problem& problem, const Indices& pool, const Indices& chosen) {
  const RowMatrix factor = inverse_factor(problem.whitened_information(chosen));
  if (factor.size() == 0) {
    return pool;
  }
  return by_falling(variances(problem.whitened(pool), factor), pool);
}

}  // namespace

RowMatrix candidate_points(const ColumnBlocks& candidates) {
  const Index parameters = candidates.shape().parameters;
  RowMatrix points(candidates.count(), candidates.shape().width());
  // Any direction will do that no row is likely to be orthogonal to.
  const Vector side = Vector::LinSpaced(parameters, 1, 2).array().sqrt().sin();
  for (Index j = 0; j < points.rows(); ++j) {
    candidates.get(j, points.row(j).data());
    for (Index first = 0; first < points.cols(); first += parameters) {
      auto row = points.row(j).segment(first, parameters);
      if (row.dot(side) < 0) {
        row *= -1;
      }
    }
  }
  return points;
}

Indices farthest_first_clusters(const RowMatrix& points, Index count) {
  Indices cluster(static_cast<std::size_t>(points.rows()), 0);
  Vector distance = Vector::Constant(points.rows(), kInfinity);
  Index centre = 0;
  for (Index k = 0; k < count; ++k) {
    for (Index j = 0; j < points.rows(); ++j) {
      const double d = (points.row(j) - points.row(centre)).squaredNorm();
      if (d < distance[j]) {
        distance[j] = d;
        at(cluster, j) = k;
      }
    }
    if (!(distance.maxCoeff(&centre) > 0)) {
      break;
    }
  }
  return cluster;
}

PoolSearch::PoolSearch(const Problem& problem, Indices pool, const Indices& chosen)
    : problem_(problem), pool_(std::move(pool)) {
  for (const Index candidate : chosen) {
    chosen_.push_back(std::find(pool_.begin(), pool_.end(), candidate) - pool_.begin());
  }
}

Indices PoolSearch::chosen() const {
  Indices result = named(chosen_, pool_);
  std::sort(result.begin(), result.end());
  return result;
}

bool PoolSearch::allowed(Index place, Index member) const {
  for (Index k = 0; k < size_of(chosen_); ++k) {
    const Index other = at(chosen_, k);
    if (other == member ||
        (k != place && problem_.spacing.conflict(at(pool_, member), at(pool_, other)))) {
      return false;
    }
  }
  return true;
}

void PoolSearch::kick_and_descend(Index parts_wanted, Index least, Index most, Random& random) {
  const Indices part =
      farthest_first_clusters(candidate_points(problem_.whitened(pool_)), parts_wanted);
  std::vector<Indices> parts(static_cast<std::size_t>(*std::max_element(part.begin(), part.end())) +
                             1);
  for (Index member = 0; member < size_of(part); ++member) {
    at(parts, at(part, member)).push_back(member);
  }
  Indices best = chosen_;
  double best_merit = merit();
  const Shape shape = problem_.shape();
  const Index bearable = std::max(kFewestKicks, kKickEffort / (shape.rows * shape.width()));
  const Index kicks = std::min<Index>(problem_.options.kicks, bearable);
  for (Index kick = 0; kick < kicks; ++kick) {
    check_interrupt();
    chosen_ = best;
    for (Index swaps = least + random.below(most - least + 1); swaps > 0; --swaps) {
      const Index place = random.below(size_of(chosen_));
      const Indices& from = at(parts, random.below(size_of(parts)));
      const Index member = at(from, random.below(size_of(from)));
      if (allowed(place, member)) {
        at(chosen_, place) = member;
      }
    }
    rebuild();
    descend(best_merit);
    if (merit() > best_merit + kSame) {
      best = chosen_;
      best_merit = merit();
    }
  }
  chosen_ = best;
  rebuild();
}

DeterminantSearch::DeterminantSearch(const Problem& problem, const Indices& pool,
                                     const Indices& chosen, double ridge)
    : PoolSearch(problem, sorted_pool(problem, pool, chosen), chosen),
      shape_(problem.shape()),
      fixed_(problem.whitened_fixed + ridge * problem.identity()),
      rows_(problem.whitened(pool_)),
      products_(rows_) {
  rebuild();
}

void DeterminantSearch::rebuild() {
  since_rebuild_ = 0;
  chosen_rows_.resize(size_of(chosen_) * shape_.rows, shape_.parameters);
  for (Index place = 0; place < size_of(chosen_); ++place) {
    rows_.get(at(chosen_, place), chosen_rows_.row(place * shape_.rows).data());
  }
  information_.reset(fixed_ + product(chosen_rows_.transpose(), chosen_rows_));
  if (!information_.positive_definite()) {
    return;
  }
  products_.compute(inverse_factor(information_.matrix()));
  for (const Index member : chosen_) {
    products_.hide(member);
  }
}

void DeterminantSearch::exchange(const Pair& pair) {
  const Index entering = pair.best.candidate;
  const Index leaving = std::exchange(at(chosen_, pair.place), entering);
  if (++since_rebuild_ >= kExchangesKept || problem_.spacing.active()) {
    rebuild();
    return;
  }
  const Index r = shape_.rows;
  const RowMatrix out = rows_.rows(leaving);
  auto rows = chosen_rows_.middleRows(pair.place * r, r);
  rows = rows_.rows(entering);
  products_.update(information_.add(rows.data(), r, 1));
  products_.update(information_.add(out.data(), r, -1));
  products_.hide(entering);
  products_.set(leaving, product(product(out, information_.inverse()), out.transpose()));
}

// The best partner of the first pose that has one, poses of least variance first: their exchange
// gains most. To compare with the partners of all the others would cost more than it gains.
DeterminantSearch::Pair DeterminantSearch::next_pair() {
  const Index r = shape_.rows;
  const RowMatrix solved = chosen_rows_ * information_.inverse();
  const Vector by_row = chosen_rows_.cwiseProduct(solved).rowwise().sum();
  Vector untried = Eigen::Map<const RowMatrix>(by_row.data(), size_of(chosen_), r).rowwise().sum();
  const double largest = products_.trace(products_.largest());
  // No ratio is above 1 + d_j - d_i (one row) or exp(d_j - d_i), for a pose and those after it.
  const double least_gain = r == 1 ? kGain : std::log1p(kGain);
  const bool spaced = problem_.spacing.active();
  Pair pair{-1, {1 + kGain, -1}};
  for (Index tried = 0; tried < untried.size() && pair.best.candidate < 0; ++tried) {
    if (untried.minCoeff(&pair.place) + least_gain >= largest && !spaced) {
      break;
    }
    untried[pair.place] = kInfinity;
    if (spaced) {
      hide_all_but_those_for(pair.place);
    }
    products_.best_pair(leaving_pose(chosen_rows_.middleRows(pair.place * r, r),
                                     solved.middleRows(pair.place * r, r)),
                        pair.best);
  }
  return pair;
}

// With a minimum distance the members that may enter depend on the pose that leaves.
void DeterminantSearch::hide_all_but_those_for(Index place) {
  products_.compute(inverse_factor(information_.matrix()));
  for (Index j = 0; j < rows_.count(); ++j) {
    if (!allowed(place, j)) {
      products_.hide(j);
    }
  }
}

void DeterminantSearch::descend(double known) {
  // Where M is nearly singular, rounding could let equal sets change places for ever.
  double computed_afresh = -kInfinity;
  while (information_.positive_definite() && !(std::abs(merit() - known) < kSame)) {
    check_interrupt();
    const Pair pair = next_pair();
    if (pair.best.candidate < 0) {
      return;
    }
    exchange(pair);
    if (since_rebuild_ == 0) {
      if (merit() <= computed_afresh) {
        return;
      }
      computed_afresh = merit();
    }
  }
}

CriterionSearch::CriterionSearch(const Problem& problem, Indices pool, const Indices& chosen)
    : PoolSearch(problem, std::move(pool), chosen), rows_(problem.candidates.rows(pool_)) {
  rebuild();
}

void CriterionSearch::rebuild() {
  information_ = problem_.information(named(chosen_, pool_));
  merit_ = criterion_merit(information_, problem_.options);
  if (problem_.options.criterion == Criterion::expected_error && std::isfinite(merit_)) {
    const ErrorSlopes slopes = error_slopes(information_, problem_.options.error_weight);
    inverse_ = slopes.inverse;
    weighted_ = product(rows_, slopes.weighted);
    solved_.resize(rows_.rows(), rows_.cols());
    is_solved_.assign(static_cast<std::size_t>(size_of(pool_)), false);
  } else {
    weighted_.resize(0, 0);
  }
}

Vector CriterionSearch::first_order() const {
  const RowMatrix changed =
      weighted_.size() != 0
          ? RowMatrix(weighted_ * std::exp(merit_))
          : product(rows_, criterion_gradient(information_, problem_.options).total());
  const Vector by_row = changed.cwiseProduct(rows_).rowwise().sum();
  const Index r = problem_.shape().rows;
  return Eigen::Map<const RowMatrix>(by_row.data(), by_row.size() / r, r).rowwise().sum();
}

double CriterionSearch::exact_merit_after(Index place, Index member) const {
  const Index r = problem_.shape().rows;
  const auto in = rows_.middleRows(member * r, r);
  const auto out = rows_.middleRows(at(chosen_, place) * r, r);
  return criterion_merit(information_ + in.transpose() * in - out.transpose() * out,
                         problem_.options);
}

ExchangedRows CriterionSearch::exchanged(Index member) {
  const Index r = problem_.shape().rows;
  const auto own = [&](RowMatrix& of) { return of.middleRows(member * r, r); };
  if (!at(is_solved_, member)) {
    own(solved_).noalias() = own(rows_) * inverse_;
    at(is_solved_, member) = true;
  }
  return {own(rows_), own(solved_), own(weighted_)};
}

double CriterionSearch::merit_after(Index place, Index member) {
  if (weighted_.size() != 0) {
    const auto gain = error_gain(exchanged(member), exchanged(at(chosen_, place)));
    if (gain) {
      return -std::log(std::exp(-merit_) - *gain);
    }
  }
  return exact_merit_after(place, member);
}

bool CriterionSearch::improve(Index tries) {
  const Vector values = first_order();
  struct Pair {
    double gain;  // of the merit, to first order
    Index place, member;
  };
  std::vector<Pair> pairs;
  double best = merit_ + kGain;
  // The expected error does not fall by more than its slope says: what a pair has to gain at least.
  const auto least = [&] {
    return weighted_.size() == 0 ? -kInfinity : -std::expm1(merit_ - best);
  };
  const double first = least();
  for (Index place = 0; place < size_of(chosen_); ++place) {
    for (Index j = 0; j < values.size(); ++j) {
      const double gain = values[j] - values[at(chosen_, place)];
      if (gain > first) {
        pairs.push_back({gain, place, j});
      }
    }
  }
  // The most promising ones first, of which few are looked at.
  const auto after = [](const Pair& a, const Pair& b) {
    return std::tie(a.gain, b.place, b.member) < std::tie(b.gain, a.place, a.member);
  };
  std::make_heap(pairs.begin(), pairs.end(), after);
  std::optional<Pair> best_pair;
  Index tried = 0;
  for (auto end = pairs.end(); size_of(pairs) - (end - pairs.begin()) < tries; --end) {
    if (end == pairs.begin() || (tried >= kPromising && best_pair)) {
      break;
    }
    std::pop_heap(pairs.begin(), end, after);
    const auto pair = std::prev(end);
    if (!(pair->gain > least())) {
      break;
    }
    if (!allowed(pair->place, pair->member)) {
      continue;
    }
    ++tried;
    check_interrupt();
    const double merit = merit_after(pair->place, pair->member);
    if (merit > best) {
      best = merit;
      best_pair = *pair;
    }
  }
  // Rounding of quick merits shall not exchange two poses for ever.
  const bool better = best_pair.has_value() &&
                      (weighted_.size() == 0 ||
                       exact_merit_after(best_pair->place, best_pair->member) > merit_ + kGain);
  if (better) {
    at(chosen_, best_pair->place) = best_pair->member;
    rebuild();
  }
  return better;
}

void CriterionSearch::descend(double /*known*/) {
  while (improve(kPromising)) {
  }
}

void CriterionSearch::descend_thoroughly() {
  while (improve(size_of(chosen_) * rows_.count())) {
  }
}

}  // namespace symkin::design::detail
