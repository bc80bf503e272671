// SPDX-License-Identifier: MIT
#include "symkin/design/selection.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>

#include "symkin/design/counted.hpp"
#include "symkin/design/criteria.hpp"
#include "symkin/design/criterion_design.hpp"
#include "symkin/design/design_bounds.hpp"
#include "symkin/design/problem.hpp"
#include "symkin/design/spares.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

Choice run_method(const SelectionProblem& problem) {
  switch (problem.options.method) {
    case SelectionMethod::sun_hollerbach:
      return select_sun_hollerbach(problem);
    case SelectionMethod::exhaustive:
      return select_exhaustive(problem);
    case SelectionMethod::random:
      return select_random(problem);
    case SelectionMethod::all:
      return select_all(problem);
    case SelectionMethod::exchange:
      break;
  }
  return select_exchange(problem);
}

void refuse_too_few(const SelectionProblem& problem, const std::vector<Index>& chosen) {
  const auto found = static_cast<Index>(chosen.size());
  if (found < problem.free_count && problem.options.method != SelectionMethod::all) {
    const auto required = static_cast<Index>(problem.options.required.size());
    throw InvalidInput("only " + std::to_string(found + required) + " of " +
                       std::to_string(problem.options.count) +
                       " poses were found that keep the minimum distance " +
                       std::to_string(problem.options.minimum_distance) + " from each other");
  }
}

[[noreturn]] void refuse_selection(const SelectionProblem& problem,
                                   const std::vector<Index>& chosen) {
  const Eigen::SelfAdjointEigenSolver<RowMatrix> eigen(problem.whitened_information(chosen));
  const Vector& values = eigen.eigenvalues();
  const Index p = values.size();
  const Index missing =
      std::max<Index>(1, (values.array() < 1e-12 * std::max(values[p - 1], 1e-300)).count());
  const RowMatrix& transform = problem.whitening.transform;
  RowMatrix inverse = RowMatrix::Identity(p, p);
  transform.triangularView<Eigen::Lower>().solveInPlace(inverse);
  // Of the columns of the candidates' rows.
  const Vector lengths = inverse.rowwise().norm();
  const RowMatrix directions =
      lengths.asDiagonal() * transform.transpose() * eigen.eigenvectors().leftCols(missing);
  throw NotIdentifiable("the choice of " + counted(problem.options.count, "pose") +
                            " does not show " + counted(missing, "combination") + " of the " +
                            std::to_string(p) +
                            " parameters, although the candidates do; select more poses",
                        named_directions(directions, lengths.cwiseInverse()));
}

// Methods that prove nothing themselves get the bounds of the approximate designs.
void certify(const SelectionProblem& problem, Choice& choice, double log_det) {
  const bool no_choice = problem.free_count == 0 ||
                         static_cast<Index>(choice.chosen.size()) == problem.candidates.available();
  if (no_choice) {
    choice.certificate.log_det_bound_distinct = log_det;
    choice.certificate.proven_optimal = true;
  }
  const bool unbounded = std::isinf(choice.certificate.log_det_bound_repeats);
  if (unbounded && problem.options.method != SelectionMethod::all && problem.free_count > 0) {
    Random random(problem.options.seed);
    const Certificate bounds = bound_designs(problem, random).certificate;
    choice.certificate.log_det_bound_repeats = bounds.log_det_bound_repeats;
    choice.certificate.log_det_bound_distinct =
        std::min(choice.certificate.log_det_bound_distinct, bounds.log_det_bound_distinct);
  }
  choice.certificate.compare(log_det, problem.parameters());
}

// The same for the criterion itself.
void certify_criterion(const SelectionProblem& problem, Choice& choice, double value) {
  Certificate& certificate = choice.certificate;
  if (problem.options.criterion == Criterion::O1) {
    const auto p = static_cast<double>(problem.parameters());
    certificate.criterion_bound = std::exp(certificate.log_det_bound_distinct / (2 * p)) / p;
    certificate.criterion_efficiency = certificate.efficiency_distinct;
    return;
  }
  if (certificate.proven_optimal) {
    certificate.criterion_bound = value;
  } else if (certificate.criterion_bound == 0) {
    certificate.criterion_bound = criterion_design(problem, choice.chosen).bound;
  }
  const double share = value / certificate.criterion_bound;
  const bool is_error = problem.options.criterion == Criterion::expected_error;
  certificate.criterion_efficiency = std::min(1.0, is_error ? 1 / share : share);
}

}  // namespace

Selection select_poses(const RowSource& candidates, const SelectionOptions& options) {
  const SelectionProblem problem(candidates, options);
  Choice choice = problem.free_count > 0 || options.method == SelectionMethod::all
                      ? run_method(problem)
                      : Choice{};
  refuse_too_few(problem, choice.chosen);
  Selection result;
  result.log_det = problem.log_det(choice.chosen);
  if (!std::isfinite(result.log_det)) {
    refuse_selection(problem, choice.chosen);
  }
  certify(problem, choice, result.log_det);
  result.criterion_value = criterion_value(problem.information(choice.chosen), options);
  certify_criterion(problem, choice, result.criterion_value);
  result.certificate = choice.certificate;
  result.spares = spare_poses(problem, choice.chosen);
  result.exchanges = choice.exchanges;
  result.passes = choice.passes;
  result.nodes = choice.nodes;
  result.indices = std::move(choice.chosen);
  result.indices.insert(result.indices.end(), options.required.begin(), options.required.end());
  std::sort(result.indices.begin(), result.indices.end());
  return result;
}

Selection select_poses(const CandidateRows& candidates, const SelectionOptions& options) {
  return select_poses(RowsInMemory(candidates), options);
}

}  // namespace symkin
