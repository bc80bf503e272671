// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/robust_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// "; measure 4 poses more"
std::string advice(const WhitenedSystem& blocks, double leverage, const RobustLoss& loss) {
  const auto p = static_cast<double>(blocks.jacobian.cols());
  const double k = static_cast<double>(blocks.rows()) / static_cast<double>(blocks.count());
  const Index more = static_cast<Index>(std::ceil(3 * p / k)) - blocks.count();
  std::string what = leverage <= kMostLeverage && loss.family->start != LossFamily::Start::two
                         ? "; take the loss \"cauchy\", or measure "
                         : "; measure ";
  return what +
         (more > 0 ? std::to_string(more) + (more == 1 ? " pose more" : " poses more")
                   : std::string("more poses near it")) +
         ", or do without a loss";
}

}  // namespace

Vector leverages(const WhitenedSystem& blocks) {
  const Vector of_rows =
      LinearFit(blocks.jacobian, Vector::Ones(blocks.jacobian.rows())).leverages();
  Vector means(blocks.count());
  for (Index i = 0; i < blocks.count(); ++i) {
    means[i] =
        of_rows.segment(blocks.first[static_cast<std::size_t>(i)], blocks.conditions(i)).mean();
  }
  return means;
}

std::vector<Index> unguarded(const WhitenedSystem& blocks, const RobustLoss& loss,
                             const std::string& whose, const std::vector<Index>& names) {
  const Vector each = leverages(blocks);
  if (each.size() == 0) {
    return {};
  }
  Index worst = 0;
  const double largest = each.maxCoeff(&worst);
  const bool cauchy = loss.family->start == LossFamily::Start::two;
  if (largest > kMostLeverage || (largest > kGuarded && !cauchy)) {
    throw InvalidInput(
        "the loss \"" + loss.family->name + "\" would not see a gross error at pose " +
        std::to_string(names[static_cast<std::size_t>(worst)] + 1) + ", which " + whose +
        " follows (leverage " + std::to_string(largest).substr(0, 5) + "; at most " +
        (cauchy ? "0.75" : "0.5") + ")" + advice(blocks, largest, loss));
  }
  std::vector<Index> open;
  for (Index i = 0; i < blocks.count(); ++i) {
    if (each[i] > kGuarded) {
      open.push_back(names[static_cast<std::size_t>(i)]);
    }
  }
  return open;
}

std::vector<RobustLoss> stages_of(const RobustLoss& loss) {
  using Start = LossFamily::Start;
  std::vector<RobustLoss> stages;
  if (!loss.any()) {
    return stages;
  }
  const auto before = [&](const char* name) {
    stages.push_back(loss_named(name));
    stages.back().spread = loss.spread;
  };
  if (loss.family->start != Start::least_squares) {
    before("huber");
  }
  if (loss.family->start == Start::cauchy) {
    before("cauchy");
  }
  stages.push_back(loss);
  return stages;
}

RobustStatistics robust_statistics(const Vector& squares, const std::vector<Index>& conditions,
                                   Index parameters, BlockLosses& losses, Index priors,
                                   double prior_squares) {
  const auto p = static_cast<double>(parameters);
  double rows = 0;
  double psi_squares = 0;
  double weights = 0;
  double slopes = 0;
  double slope_squares = 0;
  double kept_rows = static_cast<double>(priors);
  double mean = kept_rows;
  double taken = kept_rows;
  double variance = 2 * kept_rows;
  RobustStatistics found;
  found.sum_of_squares = prior_squares;
  const double unit = losses.spread() * losses.spread();
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    if (conditions[i] == 0) {
      continue;
    }
    const BlockLoss& loss = losses.of(conditions[i]);
    const double square = squares[static_cast<Index>(i)];
    const BlockLoss::Value value = loss.at(square);
    const auto k = static_cast<double>(conditions[i]);
    const double slope = value.slope(square, conditions[i]);
    rows += k;
    psi_squares += value.weight * value.weight * square;
    weights += k * value.weight;
    slopes += k * slope;
    slope_squares += k * slope * slope;
    if (value.weight >= kRejectedWeight) {
      ++found.kept;
      kept_rows += k;
      mean += loss.kept().mean;
      taken += loss.kept().mean * loss.kept().taken;
      variance += loss.kept().variance;
      found.sum_of_squares += square / unit;
    }
  }
  found.student_degrees = rows + static_cast<double>(priors) - p;
  const double a = psi_squares / std::max(rows - p, 1.0);
  const double b = slopes / rows;
  const double scatter = std::max(slope_squares / rows - b * b, 0.0);
  const double growth = 1 + p / rows * scatter / (b * b);
  found.variance = b > 0 ? a * weights / rows / (b * b) * growth * growth
                         : std::numeric_limits<double>::infinity();
  const double share =
      p < kept_rows ? 1 - taken / mean * p / (rows + static_cast<double>(priors)) : 0;
  found.degrees_of_freedom = share > 0 ? share * 2 * mean * mean / variance : 0;
  found.chi_square =
      share > 0 ? found.sum_of_squares * found.degrees_of_freedom / (mean * share) : 0;
  return found;
}

}  // namespace symkin
