// SPDX-License-Identifier: MIT
#include "symkin/estimation/robust_loss.hpp"

#include <ceres/loss_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <tuple>
#include <utility>

#include "symkin/estimation/detail/chi.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

template <typename Loss>
std::unique_ptr<ceres::LossFunction> make(double bend) {
  return std::make_unique<Loss>(bend);
}

// One line a loss.
const std::array<LossFamily, 3>& families() {
  using Start = LossFamily::Start;
  static const std::array<LossFamily, 3> all{{
      {"huber", Start::least_squares, make<ceres::HuberLoss>},
      {"cauchy", Start::two, make<ceres::CauchyLoss>},
      {"tukey", Start::cauchy, make<ceres::TukeyLoss>},
  }};
  return all;
}

BlockLoss::Value value_of(const ceres::LossFunction& function, double square) {
  std::array<double, 3> rho{};
  function.Evaluate(square, rho.data());
  return {rho[0], rho[1], rho[2]};
}

// See bend_of().
struct Gains {
  double a, b;
};
Gains gains_of(const ceres::LossFunction& function, double bend, Index conditions) {
  const auto k = static_cast<double>(conditions);
  const double a = chi_expectation(conditions, bend, [&](double d) {
    const double psi = value_of(function, d * d).weight * d;
    return psi * psi / k;
  });
  const double b = chi_expectation(conditions, bend, [&](double d) {
    return value_of(function, d * d).slope(d * d, conditions);
  });
  return {a, b};
}

// Where a falling function crosses zero between two places.
template <typename Function>
double crossing(double low, double high, const Function& function) {
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = (low + high) / 2;
    (function(middle) > 0 ? low : high) = middle;
  }
  return (low + high) / 2;
}

// A fit leaves of noise e the residual e - (h / b) psi(e) and what other blocks bring, of variance
// h a / b^2 each to first order. Mean and share of g(e) = d^2 and 1 below the limit then follow by
// partial integration, so that no derivative of g is needed where it jumps:
//   E[g] + h E[g c],  c = (k b(d) - w d^2) / b + a / (2 b^2) (d^2 - k)
double taken_of(const ceres::LossFunction& function, double bend, Index conditions,
                const BlockLoss::Kept& kept) {
  const auto k = static_cast<double>(conditions);
  const auto [a, b] = gains_of(function, bend, conditions);
  const auto change = [&, a = a, b = b](double d) {
    const double square = d * d;
    const BlockLoss::Value value = value_of(function, square);
    const double by_own = (k * value.slope(square, conditions) - value.weight * square) / b;
    const double by_others = a / (2 * b * b) * (square - k);
    return (square - kept.mean) * (by_own + by_others);
  };
  return -chi_expectation(conditions, bend, change, kept.limit) / (kept.share * kept.mean);
}

// Up to which norm a block is kept.
double limit_of(const ceres::LossFunction& function, double bend) {
  constexpr double kFar = 1e6;  // of the bend
  const auto excess = [&](double d) { return value_of(function, d * d).weight - kRejectedWeight; };
  return excess(kFar * bend) >= 0 ? std::numeric_limits<double>::infinity()
                                  : crossing(0, kFar * bend, excess);
}

BlockLoss::Kept kept_of(const ceres::LossFunction& function, double bend, Index conditions) {
  const double limit = limit_of(function, bend);
  BlockLoss::Kept kept =
      std::isinf(limit) ? BlockLoss::untruncated(conditions) : chi_below(conditions, limit);
  kept.taken = taken_of(function, bend, conditions, kept);
  return kept;
}

double efficient_bend(const LossFamily& family, Index conditions) {
  constexpr double kEfficiency = 0.95;
  constexpr double kLeast = 0.05;  // of the norm of a normal block
  constexpr double kMost = 30;
  const double size = std::sqrt(static_cast<double>(conditions));
  return crossing(kLeast * size, kMost * size, [&](double tried) {
    const auto [a, b] = gains_of(*family.make(tried), tried, conditions);
    return kEfficiency - b * b / a;
  });
}

// Norms of many conditions are all alike, so that 95% are reached by smaller and smaller bends,
// from ten on by any: blocks of more than a full pose's are kept as often as these are.
double usual_bend(const LossFamily& family, Index conditions) {
  constexpr Index kInFull = 6;
  if (conditions <= kInFull) {
    return efficient_bend(family, conditions);
  }
  const double full = efficient_bend(family, kInFull);
  const double limit = limit_of(*family.make(full), full);
  const double larger = std::sqrt(static_cast<double>(conditions) / kInFull);
  if (std::isinf(limit)) {
    return larger * full;
  }
  const double share = chi_below(kInFull, limit).share;
  return crossing(full, 2 * larger * full, [&](double tried) {
    return share - chi_below(conditions, limit_of(*family.make(tried), tried)).share;
  });
}

// Where a loss bends and what blocks it keeps there, computed once.
struct Shape {
  double bend = 0;
  BlockLoss::Kept kept{};
};
Shape shape_of(const LossFamily& family, Index conditions, double scale) {
  static std::mutex mutex;
  static std::map<std::tuple<decltype(family.make), Index, double>, Shape> known;
  const std::lock_guard lock(mutex);
  const auto [shape, is_new] = known.try_emplace({family.make, conditions, scale});
  if (is_new) {
    Shape& made = shape->second;
    made.bend = scale > 0 ? scale * std::sqrt(static_cast<double>(conditions))
                          : usual_bend(family, conditions);
    made.kept = kept_of(*family.make(made.bend), made.bend, conditions);
  }
  return shape->second;
}

}  // namespace

void LossFamily::check() const {
  constexpr double kNear = 1e-9;
  const auto loss = make == nullptr ? nullptr : make(1);
  if (loss == nullptr) {
    throw InvalidInput("the loss \"" + name + "\" makes no ceres::LossFunction");
  }
  double rho[3];
  loss->Evaluate(0, rho);
  if (!(std::abs(rho[0]) < kNear && std::abs(rho[1] - 1) < kNear)) {
    throw InvalidInput("the loss \"" + name + "\" has rho(0) = " + std::to_string(rho[0]) +
                       " and rho'(0) = " + std::to_string(rho[1]) +
                       "; expected 0 and 1, which weighs small residuals as if there were no loss");
  }
}

void RobustLoss::check() const {
  for (const auto& [name, value] : {std::pair{"scale", scale}, std::pair{"spread", spread}}) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw InvalidInput("loss " + std::string(name) + " = " + std::to_string(value) +
                         "; expected a positive number of standard deviations, or 0 for the " +
                         (name == std::string("scale") ? "usual one" : "residuals' own"));
    }
  }
  if (any()) {
    family->check();
  }
}

std::vector<std::string> loss_names() {
  std::vector<std::string> names{"none"};
  for (const LossFamily& family : families()) {
    names.push_back(family.name);
  }
  return names;
}

RobustLoss loss_named(std::string_view name, double scale) {
  if (name == "none") {
    return {nullptr, scale};
  }
  for (const LossFamily& family : families()) {
    if (family.name == name) {
      return {&family, scale};
    }
  }
  std::string known;
  for (const std::string& each : loss_names()) {
    known += (known.empty() ? "\"" : ", \"") + each + "\"";
  }
  throw InvalidInput("loss is \"" + std::string(name) + "\"; expected one of " + known);
}

double bend_of(const LossFamily& family, Index conditions) {
  return shape_of(family, conditions, 0).bend;
}

BlockLoss::Kept BlockLoss::untruncated(Index conditions) {
  const auto k = static_cast<double>(conditions);
  return {std::numeric_limits<double>::infinity(), 1, k, 2 * k, 1};
}

BlockLoss::BlockLoss(const RobustLoss& loss, Index conditions, double spread)
    : conditions_(conditions),
      spread_(spread),
      family_(loss.family),
      kept_(untruncated(conditions)) {
  if (any()) {
    const Shape shape = shape_of(*family_, conditions, loss.scale);
    kept_ = shape.kept;
    bend_ = shape.bend * spread_;
    function_ = family_->make(bend_);
  }
}

BlockLoss::BlockLoss(const BlockLoss& other)
    : conditions_(other.conditions_),
      bend_(other.bend_),
      spread_(other.spread_),
      family_(other.family_),
      function_(other.function()),
      kept_(other.kept_) {}
BlockLoss::BlockLoss(BlockLoss&& other) noexcept = default;
BlockLoss& BlockLoss::operator=(BlockLoss other) noexcept {
  std::swap(conditions_, other.conditions_);
  std::swap(bend_, other.bend_);
  std::swap(spread_, other.spread_);
  std::swap(family_, other.family_);
  std::swap(function_, other.function_);
  std::swap(kept_, other.kept_);
  return *this;
}
BlockLoss::~BlockLoss() = default;

BlockLoss::Value BlockLoss::at(double square, double relative) const {
  if (function_ == nullptr) {
    return {square, 1, 0};
  }
  const double unit = relative * relative;
  const Value value = value_of(*function_, square / unit);
  return {value.cost * unit, value.weight, value.by_square / unit};
}

std::unique_ptr<ceres::LossFunction> BlockLoss::function(double relative) const {
  return family_ == nullptr ? nullptr : family_->make(bend_ * relative);
}

const BlockLoss& BlockLosses::of(Index conditions) {
  const auto found = std::find_if(made_.begin(), made_.end(), [&](const BlockLoss& loss) {
    return loss.conditions() == conditions;
  });
  return found != made_.end() ? *found : made_.emplace_back(loss_, conditions, spread_);
}

}  // namespace symkin
