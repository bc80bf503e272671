// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <string>

#include "symkin/design/detail/blocks.hpp"
#include "symkin/design/selection.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin::design {
namespace {

using detail::at;
using detail::counted;
using detail::size_of;

std::string text(double value) { return std::to_string(value); }
std::string text(Index value) { return std::to_string(value); }

void demand(bool fulfilled, const std::string& message) {
  if (!fulfilled) {
    throw InvalidInput("pose selection: " + message);
  }
}

void check_required(const SelectionOptions& options, Index candidates) {
  std::vector<Index> required = options.required;
  std::sort(required.begin(), required.end());
  for (std::size_t k = 0; k < required.size(); ++k) {
    const Index j = required[k];
    demand(j >= 0 && j < candidates,
           "the required candidate " + text(j) + " does not exist; there are " + text(candidates));
    demand(k == 0 || required[k - 1] != j, "candidate " + text(j) + " is required twice");
    demand(options.forbidden.empty() || !at(options.forbidden, j),
           "candidate " + text(j) + " is required and forbidden");
  }
  for (std::size_t a = 0; options.minimum_distance > 0 && a < required.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double distance =
          (options.coordinates.row(required[a]) - options.coordinates.row(required[b])).norm();
      demand(distance >= options.minimum_distance,
             "the required candidates " + text(required[b]) + " and " + text(required[a]) +
                 " are " + text(distance) + " apart, less than the minimum distance " +
                 text(options.minimum_distance));
    }
  }
}

// p x p, finite, symmetric and positive semidefinite.
void check_matrix(const RowMatrix& matrix, Index p, const std::string& name) {
  demand(matrix.rows() == p && matrix.cols() == p, name + " is " + text(matrix.rows()) + " x " +
                                                       text(matrix.cols()) + ", expected " +
                                                       text(p) + " x " + text(p));
  demand(matrix.allFinite(), name + " is not finite");
  const double size = matrix.cwiseAbs().maxCoeff();
  demand((matrix - matrix.transpose()).cwiseAbs().maxCoeff() <= 1e-8 * size,
         name + " is not symmetric");
  const Vector scale = matrix.diagonal().cwiseMax(0).cwiseSqrt().unaryExpr(
      [](double s) { return s > 0 ? 1 / s : 1.0; });
  const RowMatrix scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const double least = symmetric_eigenvalues(scaled)[0];
  demand(least >= -1e-8,
         name + " is not positive semidefinite: an eigenvalue of it with unit diagonal is " +
             text(least));
}

void check_criterion(const SelectionOptions& options, Index p) {
  if (options.criterion == Criterion::expected_error) {
    check_matrix(options.error_weight, p, "the error weight");
    demand(options.error_weight.trace() > 0, "the error weight is zero");
  }
  if (options.column_scale.size() != 0) {
    demand(options.column_scale.size() == p, "the column scale has " +
                                                 text(options.column_scale.size()) +
                                                 " values, expected " + text(p));
    demand(options.column_scale.allFinite() && options.column_scale.minCoeff() > 0,
           "the column scale must be positive");
  }
  demand(options.criterion == Criterion::O1 || options.method != SelectionMethod::exhaustive,
         "only criterion O1 can be proven optimal; choose the method exchange");
  demand(options.minimum_distance == 0 || options.method != SelectionMethod::exhaustive,
         "the optimum cannot be proven with a minimum distance; choose the method exchange");
  demand(options.criterion == Criterion::O1 || options.method != SelectionMethod::sun_hollerbach,
         "the method sun_hollerbach selects by criterion O1; choose the method exchange");
}

void check_count(const SelectionOptions& options, Index candidates, Index r, Index p) {
  demand(options.count >= 1, "the count is " + text(options.count) + ", expected at least 1");
  demand(options.count <= candidates, counted(options.count, "pose") + " cannot be selected from " +
                                          counted(candidates, "candidate"));
  const Index required = size_of(options.required);
  demand(required <= options.count, "the number of required poses is " + text(required) +
                                        ", more than the count " + text(options.count));
  demand(options.count * r >= p || options.prior.size() != 0,
         counted(options.count, "pose") + " of " + counted(r, "row") + " cannot show " +
             counted(p, "parameter") + "; expected at least " + counted((p + r - 1) / r, "pose"));
}

}  // namespace

void SelectionOptions::check(Index candidates, Index rows_per_pose, Index parameters) const {
  demand(rows_per_pose >= 1 && rows_per_pose <= detail::kMaxRows,
         counted(rows_per_pose, "row") + " a pose, expected 1 to " + text(detail::kMaxRows));
  demand(candidates >= 1 && parameters >= 1, "there are no candidates");
  demand(forbidden.empty() || size_of(forbidden) == candidates,
         text(size_of(forbidden)) + " flags say what is forbidden, expected " + text(candidates));
  demand(std::isfinite(minimum_distance) && minimum_distance >= 0,
         "the minimum distance is " + text(minimum_distance) + ", expected zero or more");
  if (minimum_distance > 0) {
    demand(coordinates.rows() == candidates && coordinates.cols() > 0,
           "a minimum distance needs the coordinates of the " + text(candidates) + " candidates; " +
               text(coordinates.rows()) + " are given");
  }
  if (prior.rows() != 0 || prior.cols() != 0) {
    check_matrix(prior, parameters, "the prior information");
  }
  if (method != SelectionMethod::all) {
    check_count(*this, candidates, rows_per_pose, parameters);
  }
  check_required(*this, candidates);
  check_criterion(*this, parameters);
  demand(restarts >= 1, "restarts is " + text(Index{restarts}) + ", expected at least 1");
  demand(kicks >= 0, "kicks is " + text(Index{kicks}) + ", expected zero or more");
  demand(spare_count >= 0, "the spare count is " + text(spare_count) + ", expected zero or more");
  demand(memory_limit_bytes >= 0,
         "the memory limit is " + text(memory_limit_bytes) + " bytes, expected zero or more");
  demand(time_limit_s >= 0,
         "the time limit is " + text(time_limit_s) + " s, expected zero or more");
}

}  // namespace symkin::design
