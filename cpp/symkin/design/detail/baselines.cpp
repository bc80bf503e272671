// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "symkin/design/detail/information.hpp"
#include "symkin/design/detail/problem.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin::design::detail {
namespace {

constexpr double kRidge = 1e-6;  // until the poses of the start show every parameter

// Active calibration (Sun and Hollerbach 2008): from a random start poses are added one by one,
// each the best; then the best is added and the least useful dropped until these are the same. All
// variances follow by rank-one updates. Candidates are places in the list of those available.
class ActiveCalibration {
 public:
  explicit ActiveCalibration(const Problem& problem)
      : problem_(problem),
        shape_(problem.shape()),
        available_(problem.available()),
        rows_(problem.whitened(available_)),
        products_(rows_) {}

  Indices run(Random& random) {
    draw_start(random);
    while (size_of(chosen_) < problem_.free_count && add_best()) {
    }
    rebuild(0);
    // Rounding could let equal poses change places for ever; no real run comes near the limit.
    for (Index i = 0; i < 100 * problem_.free_count && information_.positive_definite(); ++i) {
      if (!add_best() || drop_worst() == added_) {
        break;
      }
    }
    if (size_of(chosen_) > problem_.free_count) {
      chosen_.pop_back();
    }
    return named(chosen_, available_);
  }

 private:
  // As few poses as can show every parameter.
  void draw_start(Random& random) {
    const Index least =
        std::min((shape_.parameters + shape_.rows - 1) / shape_.rows, problem_.free_count);
    chosen_.clear();
    for (Index tries = 0; size_of(chosen_) < least && tries < 1000 * least; ++tries) {
      const Index j = random.below(rows_.count());
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
    const RowMatrix factor = inverse_factor(information_.matrix());
    if (factor.size() != 0) {
      products_.compute(factor);
    }
  }

  bool add_best() {
    check_interrupt();
    added_ = products_.best_addition([&](Index j) { return allowed(j); });
    if (added_ >= 0) {
      information_.add(rows_.rows(added_).data(), shape_.rows, 1, &products_);
      chosen_.push_back(added_);
    }
    return added_ >= 0;
  }

  // The last of equal ones: that just added.
  Index drop_worst() {
    const auto worst = std::max_element(chosen_.rbegin(), chosen_.rend(), [&](Index a, Index b) {
      return products_.log_ratio(a, -1) < products_.log_ratio(b, -1);
    });
    const Index dropped = *worst;
    chosen_.erase(std::next(worst).base());
    information_.add(rows_.rows(dropped).data(), shape_.rows, -1, &products_);
    return dropped;
  }

  const Problem& problem_;
  Shape shape_;
  Indices available_;
  ColumnBlocks rows_;
  Products products_;
  Information information_;
  Indices chosen_;
  Index added_ = -1;
};

}  // namespace

Selection select_sun_hollerbach(const Problem& problem) {
  ActiveCalibration calibration(problem);
  Selection choice;
  double best = -kInfinity;
  for (int restart = 0; restart < problem.options.restarts; ++restart) {
    Random random(problem.options.seed, static_cast<std::uint64_t>(restart));
    const Indices chosen = calibration.run(random);
    const double log_det = problem.log_det(chosen);
    if (choice.indices.empty() || log_det > best) {
      best = log_det;
      choice.indices = chosen;
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
