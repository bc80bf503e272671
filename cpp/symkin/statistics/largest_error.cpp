// SPDX-License-Identifier: MIT
#include "symkin/statistics/largest_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "symkin/statistics/detail/largest_kernels.hpp"
#include "symkin/statistics/distributions.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr std::uint64_t kSeed = 20;

void check(ConstRows effects, Index rows_per_pose, Index parts, ConstRows covariances,
           const LargestErrorOptions& options) {
  if (rows_per_pose < 1 || effects.rows() % rows_per_pose != 0 || effects.rows() == 0) {
    throw InvalidInput("there are " + std::to_string(effects.rows()) + " rows of effects, " +
                       std::to_string(rows_per_pose) + " a pose; expected those of some poses");
  }
  if (parts < 1 || rows_per_pose % parts != 0) {
    throw InvalidInput("a pose has " + std::to_string(rows_per_pose) +
                       " rows of effects; expected as many of each of " + std::to_string(parts) +
                       " errors");
  }
  if (covariances.rows() == 0 || covariances.rows() % effects.cols() != 0 ||
      covariances.cols() != effects.cols()) {
    throw InvalidInput("the covariance is " + std::to_string(covariances.rows()) + " x " +
                       std::to_string(covariances.cols()) + "; expected " +
                       std::to_string(effects.cols()) + " x " + std::to_string(effects.cols()) +
                       ", or several of them one below the other");
  }
  if (!effects.allFinite() || !covariances.allFinite()) {
    throw InvalidInput("effects or a covariance are not finite");
  }
  if (!(options.probability > 0 && options.probability < 1) || options.poses < 1 ||
      options.draws < 1 || !(options.noise_degrees > 0)) {
    throw InvalidInput(
        "the largest error is asked for a probability between 0 and 1, and for poses, draws and "
        "degrees of freedom above 0");
  }
}

// E_j of the poses with the largest mean squares of each part, one below the other.
std::vector<RowMatrix> worst_poses(ConstRows effects, Index rows_per_pose, Index parts,
                                   ConstRows covariance, Index wanted) {
  const RowMatrix moves = product(effects, lower_root(covariance).transpose());
  const Index count = moves.rows() / rows_per_pose;
  const Index rows = rows_per_pose / parts;
  std::vector<RowMatrix> worst;
  for (Index part = 0; part < parts; ++part) {
    Vector trace(count);
    for (Index j = 0; j < count; ++j) {
      trace[j] = moves.middleRows(j * rows_per_pose + part * rows, rows).squaredNorm();
    }
    std::vector<Index> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), Index{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](Index a, Index b) { return trace[a] > trace[b]; });
    order.resize(static_cast<std::size_t>(std::min(wanted, count)));
    RowMatrix& of_part =
        worst.emplace_back(static_cast<Index>(order.size()) * rows, effects.cols());
    for (std::size_t k = 0; k < order.size(); ++k) {
      of_part.middleRows(static_cast<Index>(k) * rows, rows) =
          effects.middleRows(order[k] * rows_per_pose + part * rows, rows);
    }
  }
  return worst;
}

// Adds the largest squared error of each draw, the same draws for all parts.
void draw(const std::vector<RowMatrix>& moves, Index rows, Index draws, Random& random,
          std::vector<std::vector<double>>& largest) {
  const detail::FindLargest find_largest = detail::find_largest();
  RowMatrix normals = RowMatrix::Zero(moves.front().cols(), detail::kDraws);
  std::array<double, detail::kDraws> found{};
  for (Index first = 0; first < draws; first += detail::kDraws) {
    check_interrupt();
    const Index count = std::min(detail::kDraws, draws - first);
    for (auto each : normals.leftCols(count).colwise()) {
      for (double& value : each) {
        value = random.normal();
      }
    }
    for (std::size_t part = 0; part < moves.size(); ++part) {
      const RowMatrix& of_part = moves[part];
      find_largest(of_part.data(), of_part.rows() / rows, rows, of_part.cols(), normals.data(),
                   found.data());
      largest[part].insert(largest[part].end(), found.begin(), found.begin() + count);
    }
  }
}

// The largest squared errors of each part, ascending: as many draws of each covariance, in all
// those wanted.
std::vector<std::vector<double>> largest_squares(ConstRows effects, Index rows_per_pose,
                                                 Index parts, ConstRows covariances,
                                                 const LargestErrorOptions& options) {
  const std::vector<RowMatrix> worst =
      worst_poses(effects, rows_per_pose, parts, mean_covariance(covariances), options.poses);
  const Index count = covariances.rows() / covariances.cols();
  const Index draws = (options.draws + count - 1) / count;
  std::vector<std::vector<double>> largest(worst.size());
  Random random(kSeed);
  for (Index first = 0; first < covariances.rows(); first += covariances.cols()) {
    const RowMatrix root = lower_root(covariances.middleRows(first, covariances.cols()));
    std::vector<RowMatrix> moves;
    moves.reserve(worst.size());
    for (const RowMatrix& each : worst) {
      moves.push_back(product(each, root.transpose()));
    }
    draw(moves, rows_per_pose / parts, draws, random, largest);
  }
  for (std::vector<double>& each : largest) {
    std::sort(each.begin(), each.end());
  }
  return largest;
}

// As NumPy's: between the neighbours.
double empirical_quantile(const std::vector<double>& ascending, double probability) {
  const double place = probability * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, ascending.size() - 1);
  return ascending[below] +
         (place - static_cast<double>(below)) * (ascending[above] - ascending[below]);
}

// Where the mean over the draws of P(square > value chi^2_n / n) is one less the probability. The
// noise is not drawn, so that it brings no error of its own.
double over_noise(const std::vector<double>& squares, const LargestErrorOptions& options) {
  constexpr int kSteps = 40;
  const double known = empirical_quantile(squares, options.probability);
  const auto falls_short = [&](double value) {
    double sum = 0;
    for (const double square : squares) {
      sum += chi_square_tail(options.noise_degrees * square / value, options.noise_degrees);
    }
    return sum / static_cast<double>(squares.size()) > options.probability;
  };
  double low = known;
  while (low > 0 && falls_short(low)) {
    low /= 2;
  }
  double high = 2 * known;
  while (high > 0 && std::isfinite(high) && !falls_short(high)) {
    high *= 2;
  }
  for (int k = 0; k < kSteps && high - low > 1e-6 * high; ++k) {
    const double middle = 0.5 * (low + high);
    (falls_short(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

Vector largest_errors(ConstRows effects, Index rows_per_pose, Index parts, ConstRows covariances,
                      const LargestErrorOptions& options) {
  check(effects, rows_per_pose, parts, covariances, options);
  Vector found(parts);
  Index part = 0;
  for (const std::vector<double>& squares :
       largest_squares(effects, rows_per_pose, parts, covariances, options)) {
    found[part++] = std::sqrt(std::isinf(options.noise_degrees)
                                  ? empirical_quantile(squares, options.probability)
                                  : over_noise(squares, options));
  }
  return found;
}

}  // namespace symkin
