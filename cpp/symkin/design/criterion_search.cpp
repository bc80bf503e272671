// SPDX-License-Identifier: MIT
#include "symkin/design/criterion_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/design/criteria.hpp"
#include "symkin/design/information.hpp"
#include "symkin/design/roots.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr double kGain = 1e-10;          // of the merit that counts as better
constexpr std::size_t kPromising = 400;  // pairs tried when not thorough
constexpr double kRidge = 1e-10;         // of the diagonal, where the others are singular

// trace((I + D)^-1 V) for the candidates of a block, D and V their products with T^T T for the two
// factors.
class ErrorReduction {
 public:
  explicit ErrorReduction(Shape shape)
      : shape_(shape),
        spread_(shape.gram_size() * kBlock),
        weighted_(shape.gram_size() * kBlock),
        spread_trace_(kBlock),
        result_(kBlock),
        group_max_(kGroups) {}

  const double* operator()(const double* x, Index count, const RowMatrix& factor,
                           const RowMatrix& weighted_root) {
    kernels().gram(x, factor.data(), shape_, spread_.data(), spread_trace_.data(),
                   group_max_.data());
    kernels().gram(x, weighted_root.data(), shape_, weighted_.data(), result_.data(),
                   group_max_.data());
    for (Index lane = 0; lane < count; ++lane) {
      if (shape_.rows == 1) {
        result_[lane] /= 1 + spread_trace_[lane];
      } else {
        RowMatrix d = product(spread_, lane);
        d.diagonal().array() += 1;
        result_[lane] = Eigen::LLT<RowMatrix>(d).solve(product(weighted_, lane)).trace();
      }
    }
    return result_.data();
  }

 private:
  RowMatrix product(const AlignedArray& gram, Index lane) const {
    RowMatrix result(shape_.rows, shape_.rows);
    for (Index a = 0, pair = 0; a < shape_.rows; ++a) {
      for (Index b = 0; b <= a; ++b, ++pair) {
        result(a, b) = result(b, a) = gram[pair * kBlock + lane];
      }
    }
    return result;
  }

  Shape shape_;
  AlignedArray spread_, weighted_, spread_trace_, result_, group_max_;
};

}  // namespace

CriterionSearch::CriterionSearch(const SelectionProblem& problem, std::vector<Index> pool,
                                 const std::vector<Index>& chosen)
    : problem_(problem),
      shape_(problem.candidates.shape()),
      pool_(std::move(pool)),
      x_(static_cast<Index>(pool_.size()), shape_.width()) {
  problem.candidates.gather(pool_, x_);
  for (const Index candidate : chosen) {
    chosen_.push_back(std::find(pool_.begin(), pool_.end(), candidate) - pool_.begin());
  }
  rebuild();
}

std::vector<Index> CriterionSearch::chosen() const {
  std::vector<Index> result;
  for (const Index member : chosen_) {
    result.push_back(pool_[static_cast<std::size_t>(member)]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

void CriterionSearch::restore(const std::vector<Index>& state) {
  chosen_ = state;
  rebuild();
}

RowMatrix CriterionSearch::rows(Index member) const {
  RowMatrix result(shape_.rows, shape_.parameters);
  x_.get(member, result.data());
  return result;
}

void CriterionSearch::rebuild() {
  information_ = problem_.fixed;
  for (const Index member : chosen_) {
    const RowMatrix c = rows(member);
    information_ += c.transpose() * c;
  }
  merit_ = criterion_merit(information_, problem_.options);
}

// Whether the member may take the place of a chosen pose.
bool CriterionSearch::allowed(std::size_t place, Index member) const {
  for (std::size_t k = 0; k < chosen_.size(); ++k) {
    if (chosen_[k] == member ||
        (k != place && problem_.spacing.conflict(pool_[static_cast<std::size_t>(member)],
                                                 pool_[static_cast<std::size_t>(chosen_[k])]))) {
      return false;
    }
  }
  return true;
}

RowMatrix CriterionSearch::without(std::size_t place) const {
  const RowMatrix c = rows(chosen_[place]);
  RowMatrix rest = information_ - c.transpose() * c;
  rest.diagonal() += kRidge * information_.diagonal();
  return rest;
}

void CriterionSearch::exchange(std::size_t place, Index member) {
  chosen_[place] = member;
  ++exchanges_;
  rebuild();
}

// With A the inverse of M without pose i and Q = A B A, pose j instead of i makes the expected
// error trace(A B) - trace((I + C_j A C_j^T)^-1 C_j Q C_j^T).
bool CriterionSearch::improve_error() {
  ErrorReduction reduction(shape_);
  double best = std::exp(-merit_) * (1 - kGain);
  std::size_t best_place = 0;
  Index best_member = -1;
  for (std::size_t place = 0; place < chosen_.size(); ++place) {
    check_interrupt();
    const RowMatrix factor = inverse_factor(without(place));
    if (factor.size() == 0) {
      continue;
    }
    const RowMatrix inverse = factor.transpose() * factor;
    const RowMatrix weighted = inverse * problem_.options.error_weight * inverse;
    const double error = (inverse * problem_.options.error_weight).trace();
    const RowMatrix weighted_root = lower_root(weighted);
    for (Index b = 0; b < x_.blocks(); ++b) {
      const Index count = std::min(kBlock, x_.count() - b * kBlock);
      const double* reductions = reduction(x_.block(b), count, factor, weighted_root);
      for (Index lane = 0; lane < count; ++lane) {
        if (error - reductions[lane] < best && allowed(place, b * kBlock + lane)) {
          best = error - reductions[lane];
          best_place = place;
          best_member = b * kBlock + lane;
        }
      }
    }
  }
  if (best_member < 0) {
    return false;
  }
  const double before = merit_;
  const Index left = chosen_[best_place];
  exchange(best_place, best_member);
  if (merit_ <= before) {  // the ridge or rounding promised too much
    exchange(best_place, left);
    exchanges_ -= 2;
    return false;
  }
  return true;
}

// The criterion of each pair is found by its eigenvalues, the most promising to first order first.
bool CriterionSearch::improve_eigenvalues(bool thorough) {
  const RowMatrix gradient = criterion_gradient(information_, problem_.options).total();
  std::vector<double> values(pool_.size());
  for (std::size_t j = 0; j < pool_.size(); ++j) {
    const RowMatrix c = rows(static_cast<Index>(j));
    values[j] = (c * gradient).cwiseProduct(c).sum();
  }
  std::vector<Pair> pairs;
  for (std::size_t place = 0; place < chosen_.size(); ++place) {
    for (Index j = 0; j < x_.count(); ++j) {
      const double gain =
          values[static_cast<std::size_t>(j)] - values[static_cast<std::size_t>(chosen_[place])];
      pairs.push_back({place, j, gain});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.gain > b.gain; });
  double best = merit_ + kGain;
  const Pair* best_pair = nullptr;
  std::size_t tried = 0;
  for (const Pair& pair : pairs) {
    if (tried >= kPromising && (best_pair != nullptr || !thorough)) {
      break;
    }
    if (!allowed(pair.place, pair.member)) {
      continue;
    }
    ++tried;
    check_interrupt();
    const RowMatrix in = rows(pair.member);
    const RowMatrix out = rows(chosen_[pair.place]);
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

void CriterionSearch::descend(bool thorough) {
  const bool error = problem_.options.criterion == Criterion::expected_error;
  while (error ? improve_error() : improve_eigenvalues(thorough)) {
  }
}

void CriterionSearch::kick(const std::vector<Index>& state, Index count, Random& random) {
  chosen_ = state;
  for (Index k = 0; k < count; ++k) {
    const auto place = static_cast<std::size_t>(random.below(static_cast<Index>(chosen_.size())));
    const Index member = random.below(x_.count());
    if (allowed(place, member)) {
      chosen_[place] = member;
    }
  }
  rebuild();
}

}  // namespace symkin
