// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "symkin/design/detail/problem.hpp"
#include "symkin/design/detail/row_variances.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kRidge = 1e-6;     // until the poses of the start show every parameter
constexpr double kRounding = 1e-9;  // of the bounds of determinants

// Active calibration (Sun and Hollerbach 2008) from one random start: poses are added one by one,
// each the best; then the best is added and the least useful dropped until these are the same. What
// is known of all candidates follows by rank-one updates, in passes that starts have in common, and
// bounds the gain; only the few candidates that may be the best are looked at themselves.
// Candidates are places in the list of those available.
class ActiveCalibration {
 public:
  ActiveCalibration(const Problem& problem, const Indices& available, RowVariances& variances,
                    Index which, Random random)
      : problem_(problem),
        shape_(problem.shape()),
        available_(available),
        variances_(variances),
        which_(which) {
    draw_start(random);
  }

  // After each pass; whether there is anything left to do.
  bool step() {
    if (growing_) {
      growing_ = size_of(chosen_) < problem_.free_count && regular_ && add_best() &&
                 size_of(chosen_) < problem_.free_count;
      if (!growing_) {
        rebuild(0);
      }
      return true;
    }
    // Rounding could let equal poses change places for ever; no real run comes near the limit.
    return steps_++ < 100 * problem_.free_count && regular_ && add_best() && drop_worst() != added_;
  }

  Indices chosen() const {
    const auto last = chosen_.begin() + std::min(size_of(chosen_), problem_.free_count);
    return named({chosen_.begin(), last}, available_);
  }

 private:
  // As few poses as can show every parameter.
  void draw_start(Random& random) {
    const Index least =
        std::min((shape_.parameters + shape_.rows - 1) / shape_.rows, problem_.free_count);
    for (Index tries = 0; size_of(chosen_) < least && tries < 1000 * least; ++tries) {
      const Index j = random.below(size_of(available_));
      if (allowed(j)) {
        chosen_.push_back(j);
      }
    }
    rebuild(kRidge);
  }

  bool allowed(Index j) const {
    return !contains(chosen_, j) &&
           (!problem_.spacing.active() ||
            problem_.spacing.fits(at(available_, j), named(chosen_, available_)));
  }

  void rebuild(double ridge) {
    information_.reset(problem_.whitened_information(named(chosen_, available_)) +
                       ridge * problem_.identity());
    refactor();
    if (regular_) {
      variances_.compute(which_, factor_);
    }
  }

  // T, for the candidates' own rows, with the inverse information T^T T.
  void refactor() {
    const RowMatrix factor = inverse_factor(information_.matrix());
    regular_ = information_.positive_definite() && factor.size() != 0;
    if (regular_) {
      factor_ = problem_.own_transform(factor);
    }
  }

  // det(I + sign D_jj), by which det M changes with the candidate.
  double ratio(Index j, double sign) const {
    const RowMatrix root = variances_.candidates().times(j, factor_);
    return determinant(RowMatrix::Identity(shape_.rows, shape_.rows) +
                       sign * root.lazyProduct(root.transpose()));
  }

  void change(Index j, double weight) {
    const RowMatrix rows = problem_.whitened_rows({at(available_, j)});
    InverseChange change = information_.add(rows.data(), shape_.rows, weight);
    refactor();
    change.u *= problem_.whitening.transform;  // for the candidates' own rows
    variances_.update(which_, std::move(change));
  }

  // The first of the allowed candidates that add most; the group of the largest bound is looked at
  // before all others, so that most of these need no look.
  bool add_best() {
    const std::vector<double>& bounds = variances_.largest(which_);
    double most = -kInfinity;
    added_ = -1;
    const auto look = [&](Index group) {
      const auto promises = [&](double bound) { return bound * (1 + kRounding) >= most; };
      const Index end = std::min((group + 1) * kGroup, size_of(available_));
      for (Index j = group * kGroup; j < end && promises(at(bounds, group)); ++j) {
        if (promises(variances_.bound(which_, j)) && allowed(j)) {
          const double gain = ratio(j, 1);
          if (gain > most || (gain == most && j < added_)) {
            most = gain;
            added_ = j;
          }
        }
      }
    };
    look(std::max_element(bounds.begin(), bounds.end()) - bounds.begin());
    for (Index group = 0; group < size_of(bounds); ++group) {
      look(group);
    }
    if (added_ >= 0) {
      change(added_, 1);
      chosen_.push_back(added_);
    }
    return added_ >= 0;
  }

  // The last of equal ones: that just added.
  Index drop_worst() {
    std::size_t worst = 0;
    double most = -kInfinity;
    for (std::size_t place = 0; place < chosen_.size(); ++place) {
      const double left = ratio(chosen_[place], -1);
      if (left >= most) {
        most = left;
        worst = place;
      }
    }
    const Index dropped = chosen_[worst];
    chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(worst));
    change(dropped, -1);
    return dropped;
  }

  const Problem& problem_;
  Shape shape_;
  const Indices& available_;
  RowVariances& variances_;
  Index which_;
  Information information_;
  RowMatrix factor_;
  bool regular_ = false;
  Indices chosen_;
  Index added_ = -1;
  bool growing_ = true;
  Index steps_ = 0;
};

}  // namespace

Selection select_sun_hollerbach(const Problem& problem) {
  const Indices available = problem.available();
  const RowColumns rows(problem.candidates, available);
  // So many starts side by side that what is kept for them stays small beside the rows.
  const Index together = std::clamp<Index>(problem.parameters() / 4, 1, problem.options.restarts);
  RowVariances variances(rows, together);
  Selection choice;
  double best = -kInfinity;
  for (Index first = 0; first < problem.options.restarts; first += together) {
    std::vector<ActiveCalibration> starts;
    for (Index k = 0; k < together && first + k < problem.options.restarts; ++k) {
      starts.emplace_back(problem, available, variances, k,
                          Random(problem.options.seed, static_cast<std::uint64_t>(first + k)));
    }
    std::vector<bool> running(starts.size(), true);
    while (std::find(running.begin(), running.end(), true) != running.end()) {
      check_interrupt();
      variances.pass();
      for (std::size_t k = 0; k < starts.size(); ++k) {
        running[k] = running[k] && starts[k].step();
      }
    }
    for (const ActiveCalibration& start : starts) {
      const Indices chosen = start.chosen();
      const double log_det = problem.log_det(chosen);
      if (choice.indices.empty() || log_det > best) {
        best = log_det;
        choice.indices = chosen;
      }
    }
  }
  return choice;
}

Selection select_random(const Problem& problem) {
  Selection choice;
  Random random(problem.options.seed);
  Indices rest = problem.available();
  while (size_of(choice.indices) < problem.free_count && !rest.empty()) {
    std::swap(at(rest, random.below(size_of(rest))), rest.back());
    if (problem.spacing.fits(rest.back(), choice.indices)) {
      choice.indices.push_back(rest.back());
    }
    rest.pop_back();
  }
  return choice;
}

}  // namespace symkin::design::detail
