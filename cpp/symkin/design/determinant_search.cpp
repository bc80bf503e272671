// SPDX-License-Identifier: MIT
#include "symkin/design/determinant_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "symkin/design/clusters.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr double kGain = 1e-10;       // of a ratio that counts as better
constexpr double kSame = 1e-9;        // difference of log det
constexpr Index kExchangesKept = 16;  // before everything is computed afresh
constexpr Index kParts = 16;          // of the pool, for the kicks

}  // namespace

DeterminantSearch::DeterminantSearch(const SelectionProblem& problem, std::vector<Index> pool,
                                     const std::vector<Index>& chosen, double ridge)
    : problem_(problem),
      shape_(problem.candidates.shape()),
      fixed_(problem.whitened_fixed +
             ridge * RowMatrix::Identity(shape_.parameters, shape_.parameters)),
      pool_(std::move(pool)),
      leaving_(shape_),
      work_(shape_.parameters) {
  sort_pool(chosen);
  all_ = problem_.whitened(pool_);
  const std::vector<Index> part =
      farthest_first_clusters(candidate_points(all_, shape_.parameters), kParts);
  parts_.resize(static_cast<std::size_t>(*std::max_element(part.begin(), part.end()) + 1));
  for (std::size_t k = 0; k < part.size(); ++k) {
    parts_[static_cast<std::size_t>(part[k])].push_back(static_cast<Index>(k));
  }
  x_ = all_;
  gram_ = AlignedArray(shape_.rows == 1 ? 0 : all_.blocks() * shape_.gram_size() * kBlock);
  trace_ = AlignedArray(all_.blocks() * kBlock);
  group_max_ = AlignedArray(all_.blocks() * kGroups);
  is_chosen_.assign(pool_.size(), false);
  for (const Index candidate : chosen) {
    chosen_.push_back(std::find(pool_.begin(), pool_.end(), candidate) - pool_.begin());
  }
  rebuild();
}

// By falling variance: then the kernels skip most groups by the first look at their largest.
void DeterminantSearch::sort_pool(const std::vector<Index>& chosen) {
  const RowMatrix factor = inverse_factor(problem_.whitened_information(chosen));
  if (factor.size() == 0) {
    return;
  }
  const ColumnBlocks rows = problem_.whitened(pool_);
  AlignedArray d(rows.blocks() * kBlock);
  AlignedArray group_max(kGroups);
  for (Index b = 0; b < rows.blocks(); ++b) {
    kernels().variance(rows.block(b), factor.data(), shape_, d.data() + b * kBlock,
                       group_max.data());
  }
  std::vector<std::pair<double, Index>> order;
  for (std::size_t k = 0; k < pool_.size(); ++k) {
    order.emplace_back(-d[static_cast<Index>(k)], pool_[k]);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t k = 0; k < pool_.size(); ++k) {
    pool_[k] = order[k].second;
  }
}

void DeterminantSearch::restore(const std::vector<Index>& state) {
  chosen_ = state;
  rebuild();
}

std::vector<Index> DeterminantSearch::chosen() const {
  std::vector<Index> result;
  for (const Index member : chosen_) {
    result.push_back(pool_[static_cast<std::size_t>(member)]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

void DeterminantSearch::rebuild() {
  since_rebuild_ = 0;
  std::vector<double> row(static_cast<std::size_t>(shape_.width()));
  for (const Index member : hidden_) {
    all_.get(member, row.data());
    x_.set(member, row.data());
    is_chosen_[static_cast<std::size_t>(member)] = false;
  }
  const Index count = static_cast<Index>(chosen_.size());
  chosen_rows_.resize(count, shape_.width());
  for (Index place = 0; place < count; ++place) {
    const Index member = chosen_[static_cast<std::size_t>(place)];
    all_.get(member, chosen_rows_.row(place).data());
    is_chosen_[static_cast<std::size_t>(member)] = true;
    x_.clear(member);
  }
  hidden_ = chosen_;
  const Eigen::Map<const RowMatrix> rows(chosen_rows_.data(), count * shape_.rows,
                                         shape_.parameters);
  information_.reset(fixed_ + rows.transpose() * rows);
  if (problem_.spacing.active()) {
    count_conflicts();
  }
  if (!information_.positive_definite()) {
    return;
  }
  const RowMatrix factor = inverse_factor(information_.matrix());
  chosen_trace_ = (rows * factor.transpose()).rowwise().squaredNorm();
  if (shape_.rows > 1) {
    const Eigen::Map<const RowMatrix> by_row(chosen_trace_.data(), count, shape_.rows);
    chosen_trace_ = by_row.rowwise().sum().eval();
  }
  for (Index b = 0; b < x_.blocks(); ++b) {
    kernels().gram(x_.block(b), factor.data(), shape_, gram(b), trace_.data() + b * kBlock,
                   group_max_.data() + b * kGroups);
  }
}

void DeterminantSearch::count_conflicts() {
  conflicts_.assign(pool_.size(), 0);
  for (std::size_t j = 0; j < pool_.size(); ++j) {
    for (const Index member : chosen_) {
      conflicts_[j] +=
          problem_.spacing.conflict(pool_[j], pool_[static_cast<std::size_t>(member)]) ? 1 : 0;
    }
    if (conflicts_[j] > 0 && !is_chosen_[j]) {
      x_.clear(static_cast<Index>(j));
      hidden_.push_back(static_cast<Index>(j));
    }
  }
}

// All variances after M += sign C^T C.
void DeterminantSearch::update(const double* rows, double sign) {
  const Index p = shape_.parameters;
  for (Index row = 0; row < shape_.rows; ++row) {
    const double* x = rows + row * p;
    double* u = work_.data();
    information_.multiply_inverse(x, u);
    const double d = Eigen::Map<const Vector>(x, p).dot(work_);
    const double scale = -sign / (1 + sign * d);
    for (Index b = 0; b < x_.blocks(); ++b) {
      kernels().gram_update(x_.block(b), u, scale, shape_, gram(b), trace_.data() + b * kBlock,
                            group_max_.data() + b * kGroups);
    }
    for (Index place = 0; place < chosen_rows_.rows(); ++place) {
      const Eigen::Map<const RowMatrix> c(chosen_rows_.row(place).data(), shape_.rows, p);
      for (Index a = 0; a < shape_.rows; ++a) {
        const double product = c.row(a).dot(work_);
        chosen_trace_[place] += scale * product * product;
      }
    }
    information_.add(x, 1, sign);
  }
}

// A hidden member brings nothing, so it is never found.
void DeterminantSearch::hide(Index member) {
  x_.clear(member);
  set_gram(member, RowMatrix::Zero(shape_.rows, shape_.rows));
}

void DeterminantSearch::show(Index member, const double* rows) {
  x_.set(member, rows);
  const Eigen::Map<const RowMatrix> c(rows, shape_.rows, shape_.parameters);
  set_gram(member, c * information_.inverse() * c.transpose());
}

void DeterminantSearch::set_gram(Index member, const RowMatrix& products) {
  trace_[member] = products.trace();
  if (shape_.rows > 1) {
    double* lane = gram(member / kBlock) + member % kBlock;
    for (Index a = 0, pair = 0; a < shape_.rows; ++a) {
      for (Index b = 0; b <= a; ++b, ++pair) {
        lane[pair * kBlock] = products(a, b);
      }
    }
  }
  const Index group = member / kGroup;
  const double* first = trace_.data() + group * kGroup;
  group_max_[group] = *std::max_element(first, first + kGroup);
}

void DeterminantSearch::exchange(const Pair& pair) {
  Index& place = chosen_[static_cast<std::size_t>(pair.place)];
  const Index leaving = std::exchange(place, pair.member);
  ++exchanges_;
  if (++since_rebuild_ >= kExchangesKept || problem_.spacing.active()) {
    rebuild();
    return;
  }
  RowMatrix rows(2, shape_.width());
  all_.get(pair.member, rows.row(0).data());
  rows.row(1) = chosen_rows_.row(pair.place);
  chosen_rows_.row(pair.place) = rows.row(0);
  chosen_trace_[pair.place] = trace_[pair.member];
  update(rows.row(0).data(), 1);
  update(rows.row(1).data(), -1);
  hide(pair.member);
  show(leaving, rows.row(1).data());
  *std::find(hidden_.begin(), hidden_.end(), leaving) = pair.member;
  is_chosen_[static_cast<std::size_t>(leaving)] = false;
  is_chosen_[static_cast<std::size_t>(pair.member)] = true;
}

// The best partner of the first pose that has one, poses of least variance first: their exchange
// gains most. To compare with the partners of all the others would cost more than it gains.
DeterminantSearch::Pair DeterminantSearch::next_pair() {
  untried_ = chosen_trace_;
  const double largest =
      *std::max_element(group_max_.data(), group_max_.data() + group_max_.size());
  Pair best;
  best.ratio = 1 + kGain;
  for (Index tried = 0; tried < untried_.size(); ++tried) {
    Index place = 0;
    const double trace = untried_.minCoeff(&place);
    untried_[place] = std::numeric_limits<double>::infinity();
    // No ratio is above 1 + d_j - d_i (one row) or exp(d_j - d_i), for this pose and those after
    // it.
    const double least_gain = shape_.rows == 1 ? kGain : std::log1p(kGain);
    const bool hopeless = largest - trace <= least_gain && !problem_.spacing.active();
    if (best.member >= 0 || hopeless) {
      break;
    }
    leaving_.prepare(information_, chosen_rows_.row(place).data());
    for (Index b = 0; b < x_.blocks(); ++b) {
      BestPair found{best.ratio, -1};
      kernels().best_pair(x_.block(b), shape_.rows == 1 ? nullptr : gram(b),
                          trace_.data() + b * kBlock, group_max_.data() + b * kGroups,
                          leaving_.view(), shape_, found);
      if (found.lane >= 0) {
        best = {place, b * kBlock + found.lane, found.ratio};
      }
    }
    if (problem_.spacing.active()) {
      consider_neighbours(leaving_, place, best);
    }
  }
  return best;
}

// Members that only the leaving pose is too near to.
void DeterminantSearch::consider_neighbours(const LeavingPose& leaving, Index place,
                                            Pair& best) const {
  const Index pose = pool_[static_cast<std::size_t>(chosen_[static_cast<std::size_t>(place)])];
  RowMatrix rows(1, shape_.width());
  for (Index j = 0; j < all_.count(); ++j) {
    const auto member = static_cast<std::size_t>(j);
    if (conflicts_[member] == 1 && !is_chosen_[member] &&
        problem_.spacing.conflict(pool_[member], pose)) {
      all_.get(j, rows.data());
      const double ratio = leaving.ratio(information_, rows.data());
      if (ratio > best.ratio) {
        best = {place, j, ratio};
      }
    }
  }
}

void DeterminantSearch::descend(double known) {
  // Where M is nearly singular, rounding could let equal sets change places for ever.
  double computed_afresh = -std::numeric_limits<double>::infinity();
  while (information_.positive_definite() && !(std::abs(log_det() - known) < kSame)) {
    check_interrupt();
    const Pair pair = next_pair();
    if (pair.member < 0) {
      return;
    }
    exchange(pair);
    if (since_rebuild_ == 0) {
      if (log_det() <= computed_afresh) {
        return;
      }
      computed_afresh = log_det();
    }
  }
}

void DeterminantSearch::kick(const std::vector<Index>& state, Index count, Random& random) {
  chosen_ = state;
  for (Index k = 0; k < count; ++k) {
    const auto place = static_cast<std::size_t>(random.below(static_cast<Index>(chosen_.size())));
    const std::vector<Index>& part =
        parts_[static_cast<std::size_t>(random.below(static_cast<Index>(parts_.size())))];
    const Index member =
        part[static_cast<std::size_t>(random.below(static_cast<Index>(part.size())))];
    std::vector<Index> others = chosen_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(place));
    const bool free = std::find(chosen_.begin(), chosen_.end(), member) == chosen_.end() &&
                      std::none_of(others.begin(), others.end(), [&](Index other) {
                        return problem_.spacing.conflict(pool_[static_cast<std::size_t>(member)],
                                                         pool_[static_cast<std::size_t>(other)]);
                      });
    if (free) {
      chosen_[place] = member;
    }
  }
  rebuild();
}

}  // namespace symkin
