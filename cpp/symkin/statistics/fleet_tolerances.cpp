// SPDX-License-Identifier: MIT
#include "symkin/statistics/fleet_tolerances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

constexpr int kMost = 200;
constexpr double kLongest = 1;    // step of a logarithm
constexpr double kLeast = -12;    // logarithm at which a factor counts as zero
constexpr double kDone = 1e-10;   // step of every logarithm
constexpr double kSilent = 1e-9;  // information of a kind that nothing shows
constexpr int kHalvings = 40;

class Fleet {
 public:
  Fleet(ConstRows information, ConstRows scores, const std::vector<int>& kinds)
      : information_(information), scores_(scores), kinds_(kinds) {
    count_ = kinds.empty() ? 0 : *std::max_element(kinds.begin(), kinds.end()) + 1;
  }

  Index count() const { return count_; }

  // Log-likelihood of factors, its gradient by their logarithms, and Fisher's information.
  struct Likelihood {
    double value = 0;
    Vector gradient;
    RowMatrix information;
  };

  Likelihood at(const Vector& logs) const {
    const Index p = scores_.cols();
    Likelihood found{0, Vector::Zero(count_), RowMatrix::Zero(count_, count_)};
    Vector t(p);
    for (Index i = 0; i < p; ++i) {
      t[i] = std::exp(logs[kind(i)]);
    }
    for (Index robot = 0; robot < scores_.rows(); ++robot) {
      add(robot, t, found);
    }
    return found;
  }

 private:
  Index kind(Index parameter) const { return kinds_[static_cast<std::size_t>(parameter)]; }

  // C = (I + t G t)^-1 and b = C t g.
  void add(Index robot, const Vector& t, Likelihood& found) const {
    const Index p = t.size();
    RowMatrix inner = t.asDiagonal() * information_.middleRows(robot * p, p) * t.asDiagonal();
    inner.diagonal().array() += 1;
    const RowMatrix factor = inverse_factor(inner);
    if (factor.size() == 0) {
      throw InvalidInput("the information of robot " + std::to_string(robot + 1) +
                         " is not positive semidefinite");
    }
    const RowMatrix covariance = product(factor.transpose(), factor);
    const Vector asked = t.cwiseProduct(scores_.row(robot).transpose());
    const Vector b = covariance * asked;
    found.value += 0.5 * asked.dot(b) - 0.5 * log_determinant(factor);
    RowMatrix shown = -covariance;
    shown.diagonal().array() += 1;
    for (Index i = 0; i < p; ++i) {
      found.gradient[kind(i)] += b[i] * b[i] - shown(i, i);
      for (Index j = 0; j < p; ++j) {
        found.information(kind(i), kind(j)) += 2 * shown(i, j) * shown(i, j);
      }
    }
  }

  ConstRows information_;
  ConstRows scores_;
  const std::vector<int>& kinds_;
  Index count_ = 0;
};

void check(ConstRows information, ConstRows scores, const std::vector<int>& kinds) {
  const Index p = scores.cols();
  if (scores.rows() == 0 || p == 0 || information.rows() != scores.rows() * p ||
      information.cols() != p || static_cast<Index>(kinds.size()) != p) {
    throw InvalidInput("there are scores of " + std::to_string(scores.rows()) + " x " +
                       std::to_string(p) + ", information of " +
                       std::to_string(information.rows()) + " x " +
                       std::to_string(information.cols()) + " and " + std::to_string(kinds.size()) +
                       " kinds; expected those of all robots one below the other");
  }
  if (!information.allFinite() || !scores.allFinite()) {
    throw InvalidInput("information or scores of a fleet are not finite");
  }
  if (*std::min_element(kinds.begin(), kinds.end()) < 0 ||
      *std::max_element(kinds.begin(), kinds.end()) >= p) {
    throw InvalidInput("a kind of parameter is not one of 0 to " + std::to_string(p - 1));
  }
}

Vector step_of(const Fleet::Likelihood& here) {
  RowMatrix damped = here.information;
  damped.diagonal().array() += kSilent;
  return solution(damped, here.gradient).cwiseMax(-kLongest).cwiseMin(kLongest);
}

// With the others at their estimates; of kinds that end at zero nothing is known.
Vector deviations_of(const RowMatrix& information) {
  const Vector diagonal = information.diagonal();
  RowMatrix damped = information;
  damped.diagonal().array() += kSilent;
  Vector found = inverse(damped).diagonal().cwiseMax(0).cwiseSqrt();
  for (Index i = 0; i < found.size(); ++i) {
    if (!(diagonal[i] > 1e3 * kSilent)) {
      found[i] = std::numeric_limits<double>::infinity();
    }
  }
  return found;
}

}  // namespace

FleetTolerances fleet_tolerances(ConstRows information, ConstRows scores,
                                 const std::vector<int>& kinds) {
  check(information, scores, kinds);
  const Fleet fleet(information, scores, kinds);
  Vector logs = Vector::Zero(fleet.count());
  Fleet::Likelihood here = fleet.at(logs);
  FleetTolerances found;
  while (found.iterations < kMost && !found.converged) {
    check_interrupt();
    ++found.iterations;
    Vector step = step_of(here);
    bool is_better = false;
    for (int k = 0; k < kHalvings && !is_better; ++k, step *= is_better ? 1.0 : 0.5) {
      const Vector there = (logs + step).cwiseMax(kLeast);
      Fleet::Likelihood next = fleet.at(there);
      is_better = next.value >= here.value;
      if (is_better) {
        found.converged = (there - logs).cwiseAbs().maxCoeff() < kDone;
        logs = there;
        here = std::move(next);
      }
    }
    found.converged = found.converged || !is_better;
  }
  found.factors = logs.array().exp();
  found.log_deviations = deviations_of(here.information);
  return found;
}

}  // namespace symkin
