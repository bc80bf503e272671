// SPDX-License-Identifier: MIT
#include "symkin/design/largest_ratio.hpp"

#include <algorithm>
#include <limits>

#include "symkin/design/certificate.hpp"

namespace symkin {
namespace {

constexpr double kConverged = 1e-12;  // relative
constexpr int kPasses = 30;           // it converges faster than linearly

}  // namespace

LargestRatio largest_trace(const SelectionProblem& problem, const RowMatrix& transform,
                           Index keep) {
  auto top = screen_candidates(problem.candidates, {{transform, keep}}).front();
  const double sum = fixed_trace(transform, problem.fixed) + largest_sum(top, problem.free_count);
  return {sum, std::move(top)};
}

LargestRatio largest_ratio(const SelectionProblem& problem, const Ratio& ratio, Index keep) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto count = static_cast<std::size_t>(problem.free_count);
  const double fixed_gain = fixed_trace(ratio.gain, problem.fixed);
  const double fixed_loss = ratio.offset + fixed_trace(ratio.loss, problem.fixed);
  // No selection exceeds the value that its own best numerator less value times denominator makes
  // zero; each selection that shows a positive one raises the value to its own ratio.
  LargestRatio result{0, {}};
  for (int pass = 0; pass < kPasses; ++pass) {
    const Screen screen{ratio.gain, keep, -kInfinity, ratio.loss, result.value};
    result.favoured = screen_candidates(problem.candidates, {screen}).front();
    double gain = fixed_gain;
    double loss = fixed_loss;
    for (std::size_t i = 0; i < std::min(count, result.favoured.size()); ++i) {
      const RowMatrix rows = problem.candidates.rows(result.favoured[i].index);
      gain += (rows * ratio.gain.transpose()).squaredNorm();
      loss += (rows * ratio.loss.transpose()).squaredNorm();
    }
    if (!(loss > 0)) {
      return {kInfinity, std::move(result.favoured)};
    }
    const double before = result.value;
    result.value = std::max(before, gain / loss);
    if (result.value <= before * (1 + kConverged)) {
      return result;
    }
  }
  result.value = kInfinity;
  return result;
}

}  // namespace symkin
