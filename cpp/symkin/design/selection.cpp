// SPDX-License-Identifier: MIT
#include "symkin/design/selection.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/criteria.hpp"
#include "symkin/design/detail/information.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin::design {
namespace detail {
namespace {

constexpr Index kMoreThanAsked = 256;  // adding a spare lowers the rank of those like it

Selection run_method(const Problem& problem) {
  Selection choice;
  switch (problem.options.method) {
    case SelectionMethod::sun_hollerbach:
      return select_sun_hollerbach(problem);
    case SelectionMethod::exhaustive:
      return select_exhaustive(problem);
    case SelectionMethod::random:
      return select_random(problem);
    case SelectionMethod::all:
      choice.indices = problem.available();
      return choice;
    case SelectionMethod::exchange:
      break;
  }
  return select_exchange(problem);
}

void refuse_too_few(const Problem& problem, const Indices& chosen) {
  const SelectionOptions& options = problem.options;
  if (size_of(chosen) < problem.free_count && options.method != SelectionMethod::all) {
    throw InvalidInput("only " + std::to_string(chosen.size() + options.required.size()) + " of " +
                       std::to_string(options.count) +
                       " poses were found that keep the minimum distance " +
                       std::to_string(options.minimum_distance) + " from each other");
  }
}

[[noreturn]] void refuse_selection(const Problem& problem, const Indices& chosen) {
  const SymmetricEigen eigen = symmetric_eigen(problem.whitened_information(chosen));
  const Index p = problem.parameters();
  const double nothing = 1e-12 * std::max(eigen.values[p - 1], 1e-300);
  const Index missing = std::max<Index>(1, (eigen.values.array() < nothing).count());
  const RowMatrix& transform = problem.whitening.transform;
  // Of the columns of the candidates' rows.
  const Vector lengths = lower_inverse(transform).rowwise().norm();
  const RowMatrix directions =
      lengths.asDiagonal() * transform.transpose() * eigen.vectors.leftCols(missing);
  throw NotIdentifiable("the choice of " + counted(problem.options.count, "pose") +
                            " does not show " + counted(missing, "combination") + " of the " +
                            std::to_string(p) +
                            " parameters, although the candidates do; select more poses",
                        named_directions(directions, lengths.cwiseInverse()));
}

// Methods that prove nothing themselves get the bounds of the approximate designs.
void certify(const Problem& problem, Selection& choice) {
  Certificate& certificate = choice.certificate;
  if (problem.free_count == 0 || size_of(choice.indices) == problem.candidates.available()) {
    certificate.log_det_bound_distinct = choice.log_det;
    certificate.proven_optimal = true;
  }
  const bool unbounded = std::isinf(certificate.log_det_bound_repeats);
  if (unbounded && problem.options.method != SelectionMethod::all && problem.free_count > 0) {
    const Certificate bounds = bound_designs(problem).certificate;
    certificate.tighten(bounds.log_det_bound_repeats, bounds.log_det_bound_distinct);
  }
  // The optimum is itself a bound; rounding may not make an efficiency exceed one.
  const auto efficiency = [&](double bound) {
    return std::min(1.0,
                    std::exp((choice.log_det - bound) / static_cast<double>(problem.parameters())));
  };
  certificate.efficiency_repeats = efficiency(certificate.log_det_bound_repeats);
  certificate.efficiency_distinct = efficiency(certificate.log_det_bound_distinct);
}

// The same for the criterion itself.
void certify_criterion(const Problem& problem, Selection& choice) {
  const double value = choice.criterion_value;
  Certificate& certificate = choice.certificate;
  if (problem.options.criterion == Criterion::O1) {
    const auto p = static_cast<double>(problem.parameters());
    certificate.criterion_bound =
        value * std::exp((certificate.log_det_bound_distinct - choice.log_det) / (2 * p));
    certificate.criterion_efficiency = certificate.efficiency_distinct;
    return;
  }
  if (certificate.proven_optimal) {
    certificate.criterion_bound = value;
  } else if (certificate.criterion_bound == 0) {
    certificate.criterion_bound = criterion_design(problem, choice.indices).bound;
  }
  const double share = value / certificate.criterion_bound;
  const bool is_error = problem.options.criterion == Criterion::expected_error;
  certificate.criterion_efficiency = std::min(1.0, is_error ? 1 / share : share);
}

// The next best poses: each adds most to log det M of the chosen poses and the spares before it.
// Fewer than asked if no more candidates are allowed.
Indices spare_poses(const Problem& problem, const Indices& chosen) {
  Indices spares;
  Information information(problem.whitened_information(chosen));
  if (problem.options.spare_count == 0 || !information.positive_definite()) {
    return spares;
  }
  const RowMatrix factor = inverse_factor(information.matrix());
  const Index asked = std::min(problem.options.spare_count, problem.candidates.size());
  const Index keep = size_of(chosen) + 4 * asked + kMoreThanAsked;
  const Indices top = indices_of(
      screen_candidates(problem.candidates, {{problem.own_transform(factor), keep}}).front());
  const ColumnBlocks rows = problem.whitened(top);
  Products products(rows);
  products.compute(factor);
  Indices taken = chosen;
  while (size_of(spares) < asked) {
    check_interrupt();
    const Index next = products.best_addition([&](Index j) {
      return !contains(taken, at(top, j)) && problem.spacing.fits(at(top, j), taken);
    });
    if (next < 0) {
      break;
    }
    products.update(information.add(rows.rows(next).data(), rows.shape().rows, 1));
    taken.push_back(at(top, next));
    spares.push_back(at(top, next));
  }
  return spares;
}

}  // namespace
}  // namespace detail

RowsInMemory::RowsInMemory(const CandidateRows& candidates)
    : rows_(candidates.rows), rows_per_pose_(candidates.rows_per_pose) {
  if (rows_per_pose_ < 1 || rows_.rows() % rows_per_pose_ != 0) {
    throw InvalidInput(std::to_string(rows_.rows()) + " rows do not make whole candidates of " +
                       std::to_string(rows_per_pose_) + " rows each");
  }
  if (rows_.rows() == 0 || rows_.cols() == 0) {
    throw InvalidInput("there are no candidates to select from (" + std::to_string(rows_.rows()) +
                       " rows of " + std::to_string(rows_.cols()) + " parameters)");
  }
  // A row stride would make the rows of one candidate not contiguous.
  if (rows_.rows() > 1 && rows_.outerStride() != rows_.cols()) {
    throw InvalidInput("the rows of the candidates must follow each other in memory");
  }
}

Selection select_poses(const RowSource& candidates, const SelectionOptions& options) {
  const detail::Problem problem(candidates, options);
  Selection result;
  if (problem.free_count > 0 || options.method == SelectionMethod::all) {
    result = detail::run_method(problem);
  }
  std::vector<Index>& chosen = result.indices;
  detail::refuse_too_few(problem, chosen);
  result.log_det = problem.log_det(chosen);
  if (!std::isfinite(result.log_det)) {
    detail::refuse_selection(problem, chosen);
  }
  result.criterion_value = detail::criterion_value(problem.information(chosen), options);
  detail::certify(problem, result);
  detail::certify_criterion(problem, result);
  result.spares = detail::spare_poses(problem, chosen);
  chosen.insert(chosen.end(), options.required.begin(), options.required.end());
  std::sort(chosen.begin(), chosen.end());
  return result;
}

Selection select_poses(const CandidateRows& candidates, const SelectionOptions& options) {
  return select_poses(RowsInMemory(candidates), options);
}

}  // namespace symkin::design
