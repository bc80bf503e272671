// SPDX-License-Identifier: MIT
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "symkin/design/information.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr double kRidge = 1e-6;  // until the poses of the start show every parameter

// Active calibration (Sun and Hollerbach 2008): from a random start poses are added one by one,
// each the best; then the best is added and the least useful dropped until these are the same. All
// variances follow by rank-one updates.
class ActiveCalibration {
 public:
  ActiveCalibration(const SelectionProblem& problem, const ColumnBlocks& rows)
      : problem_(problem),
        rows_(rows),
        shape_(problem.candidates.shape()),
        gram_(rows.blocks() * shape_.gram_size() * kBlock),
        trace_(rows.blocks() * kBlock),
        group_max_(rows.blocks() * kGroups) {}

  std::vector<Index> run(Random& random) {
    draw_start(random);
    while (static_cast<Index>(chosen_.size()) < problem_.free_count && add_best()) {
    }
    if (ridge_) {
      ridge_ = false;
      rebuild();
    }
    // Rounding could let equal poses change places for ever; no real run comes near the limit.
    for (Index i = 0; i < 100 * problem_.free_count && information_.positive_definite(); ++i) {
      if (!add_best() || drop_worst() == added_) {
        break;
      }
      ++exchanges;
    }
    if (static_cast<Index>(chosen_.size()) > problem_.free_count) {
      chosen_.pop_back();
    }
    return chosen_;
  }

  Index exchanges = 0;

 private:
  // As few poses as can show every parameter.
  void draw_start(Random& random) {
    const Index p = shape_.parameters;
    const Index least = std::min((p + shape_.rows - 1) / shape_.rows, problem_.free_count);
    chosen_.clear();
    for (Index tries = 0; static_cast<Index>(chosen_.size()) < least && tries < 1000 * least;
         ++tries) {
      const Index j = random.below(rows_.count());
      if (allowed(j)) {
        chosen_.push_back(j);
      }
    }
    ridge_ = false;
    rebuild();
    if (!information_.positive_definite()) {
      ridge_ = true;
      rebuild();
    }
  }

  bool allowed(Index j) const {
    return !problem_.candidates.excluded(j) &&
           std::find(chosen_.begin(), chosen_.end(), j) == chosen_.end() &&
           problem_.spacing.fits(j, chosen_);
  }

  void rebuild() {
    const Index p = shape_.parameters;
    RowMatrix matrix = problem_.whitened_information(chosen_);
    if (ridge_) {
      matrix += kRidge * RowMatrix::Identity(p, p);
    }
    information_.reset(std::move(matrix));
    updates_ = 0;
    const RowMatrix factor = inverse_factor(information_.matrix());
    for (Index b = 0; b < rows_.blocks() && factor.size() != 0; ++b) {
      kernels().gram(rows_.block(b), factor.data(), shape_, gram(b), trace_.data() + b * kBlock,
                     group_max_.data() + b * kGroups);
    }
  }

  double* gram(Index block) { return gram_.data() + block * shape_.gram_size() * kBlock; }

  // log det(I + sign D_jj).
  double log_ratio(Index j, double sign) {
    const Index r = shape_.rows;
    if (r == 1) {
      return std::log1p(sign * trace_[j]);
    }
    RowMatrix matrix(r, r);
    const double* lane = gram(j / kBlock) + j % kBlock;
    for (Index a = 0, pair = 0; a < r; ++a) {
      for (Index b = 0; b <= a; ++b, ++pair) {
        matrix(a, b) = matrix(b, a) = (a == b ? 1.0 : 0.0) + sign * lane[pair * kBlock];
      }
    }
    return std::log(std::max(matrix.determinant(), std::numeric_limits<double>::min()));
  }

  bool add_best() {
    check_interrupt();
    double best = -1;
    Index candidate = -1;
    for (Index j = 0; j < rows_.count(); ++j) {
      // log det(I + D) <= trace D: most need no determinant.
      if (trace_[j] > best && allowed(j)) {
        const double gain = log_ratio(j, 1);
        if (gain > best) {
          best = gain;
          candidate = j;
        }
      }
    }
    if (candidate >= 0) {
      update(candidate, 1);
      chosen_.push_back(candidate);
      added_ = candidate;
    }
    return candidate >= 0;
  }

  Index drop_worst() {
    double best = -std::numeric_limits<double>::infinity();
    std::size_t place = 0;
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      const double loss = log_ratio(chosen_[k], -1);
      if (loss >= best) {
        best = loss;
        place = k;
      }
    }
    const Index dropped = chosen_[place];
    chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(place));
    update(dropped, -1);
    return dropped;
  }

  void update(Index candidate, double sign) {
    RowMatrix rows(shape_.rows, shape_.parameters);
    rows_.get(candidate, rows.data());
    Vector u(shape_.parameters);
    for (Index row = 0; row < shape_.rows; ++row) {
      information_.multiply_inverse(rows.row(row).data(), u.data());
      const double scale = -sign / (1 + sign * rows.row(row).dot(u));
      for (Index b = 0; b < rows_.blocks(); ++b) {
        kernels().gram_update(rows_.block(b), u.data(), scale, shape_, gram(b),
                              trace_.data() + b * kBlock, group_max_.data() + b * kGroups);
      }
      information_.add(rows.row(row).data(), 1, sign);
    }
  }

  const SelectionProblem& problem_;
  const ColumnBlocks& rows_;
  Shape shape_;
  AlignedArray gram_, trace_, group_max_;
  Information information_;
  std::vector<Index> chosen_;
  Index added_ = -1;
  int updates_ = 0;
  bool ridge_ = false;
};

}  // namespace

Choice select_sun_hollerbach(const SelectionProblem& problem) {
  std::vector<Index> everything(static_cast<std::size_t>(problem.candidates.size()));
  std::iota(everything.begin(), everything.end(), Index{0});
  const ColumnBlocks rows = problem.whitened(everything);
  ActiveCalibration calibration(problem, rows);
  Choice choice;
  double best = -std::numeric_limits<double>::infinity();
  for (int restart = 0; restart < problem.options.restarts; ++restart) {
    Random random(problem.options.seed, static_cast<std::uint64_t>(restart));
    const std::vector<Index> chosen = calibration.run(random);
    const double log_det = problem.log_det(chosen);
    if (choice.chosen.empty() || log_det > best) {
      best = log_det;
      choice.chosen = chosen;
    }
  }
  choice.exchanges = calibration.exchanges;
  return choice;
}

}  // namespace symkin
