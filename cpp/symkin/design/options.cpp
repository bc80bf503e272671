// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <sstream>
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

template <typename... Parts>
void demand(bool fulfilled, const Parts&... parts) {
  if (!fulfilled) {
    std::ostringstream message;
    message << "pose selection: ";
    (message << ... << parts);
    throw InvalidInput(message.str());
  }
}

void check_required(const SelectionOptions& options, Index candidates) {
  std::vector<Index> required = options.required;
  std::sort(required.begin(), required.end());
  for (std::size_t k = 0; k < required.size(); ++k) {
    const Index j = required[k];
    demand(j >= 0 && j < candidates, "the required candidate ", j, " does not exist; there are ",
           candidates);
    demand(k == 0 || required[k - 1] != j, "candidate ", j, " is required twice");
    demand(options.forbidden.empty() || !at(options.forbidden, j), "candidate ", j,
           " is required and forbidden");
  }
  for (std::size_t a = 0; options.minimum_distance > 0 && a < required.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double distance =
          (options.coordinates.row(required[a]) - options.coordinates.row(required[b])).norm();
      demand(distance >= options.minimum_distance, "the required candidates ", required[b], " and ",
             required[a], " are ", distance, " apart, less than the minimum distance ",
             options.minimum_distance);
    }
  }
}

// p x p, finite, symmetric and positive semidefinite.
void check_matrix(const RowMatrix& matrix, Index p, const std::string& name) {
  demand(matrix.rows() == p && matrix.cols() == p, name, " is ", matrix.rows(), " x ",
         matrix.cols(), ", expected ", p, " x ", p);
  demand(matrix.allFinite(), name, " is not finite");
  const double size = matrix.cwiseAbs().maxCoeff();
  demand((matrix - matrix.transpose()).cwiseAbs().maxCoeff() <= 1e-8 * size, name,
         " is not symmetric");
  const Vector scale = matrix.diagonal().cwiseMax(0).cwiseSqrt().unaryExpr(
      [](double s) { return s > 0 ? 1 / s : 1.0; });
  const RowMatrix scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const double least = symmetric_eigenvalues(scaled)[0];
  demand(least >= -1e-8, name,
         " is not positive semidefinite: an eigenvalue of it with unit diagonal is ", least);
}

void check_criterion(const SelectionOptions& options, Index p) {
  if (options.criterion == Criterion::expected_error) {
    check_matrix(options.error_weight, p, "the error weight");
    demand(options.error_weight.trace() > 0, "the error weight is zero");
  }
  if (options.column_scale.size() != 0) {
    demand(options.column_scale.size() == p, "the column scale has ", options.column_scale.size(),
           " values, expected ", p);
    demand(options.column_scale.allFinite() && options.column_scale.minCoeff() > 0,
           "the column scale must be positive");
  }
  demand(options.criterion == Criterion::O1 || options.method != SelectionMethod::exhaustive,
         "only criterion O1 can be proven optimal; choose the method exchange");
  demand(options.minimum_distance == 0 || options.method != SelectionMethod::exhaustive,
         "the optimum cannot be proven with a minimum distance; choose the method exchange");
  demand(options.minimum_distance == 0 || options.method != SelectionMethod::all,
         "the method all takes every candidate, however near to each other; choose the method "
         "exchange for a minimum distance");
  demand(options.criterion == Criterion::O1 || options.method != SelectionMethod::sun_hollerbach,
         "the method sun_hollerbach selects by criterion O1; choose the method exchange");
}

void check_count(const SelectionOptions& options, Index candidates, Index r, Index p) {
  demand(options.count >= 1, "the count is ", options.count, ", expected at least 1");
  demand(options.count <= candidates, counted(options.count, "pose"), " cannot be selected from ",
         counted(candidates, "candidate"));
  const Index required = size_of(options.required);
  demand(required <= options.count, "the number of required poses is ", required,
         ", more than the count ", options.count);
  demand(options.count * r >= p || options.prior.size() != 0, counted(options.count, "pose"),
         " of ", counted(r, "row"), " cannot show ", counted(p, "parameter"),
         "; expected at least ", counted((p + r - 1) / r, "pose"));
}

}  // namespace

void SelectionOptions::check(Index candidates, Index rows_per_pose, Index parameters) const {
  demand(rows_per_pose >= 1 && rows_per_pose <= detail::kMaxRows, counted(rows_per_pose, "row"),
         " a pose, expected 1 to ", detail::kMaxRows);
  demand(candidates >= 1 && parameters >= 1, "there are no candidates");
  demand(forbidden.empty() || size_of(forbidden) == candidates, size_of(forbidden),
         " flags say what is forbidden, expected ", candidates);
  demand(std::isfinite(minimum_distance) && minimum_distance >= 0, "the minimum distance is ",
         minimum_distance, ", expected zero or more");
  if (minimum_distance > 0) {
    demand(coordinates.rows() == candidates && coordinates.cols() > 0,
           "a minimum distance needs the coordinates of the ", candidates, " candidates; ",
           coordinates.rows(), " are given");
  }
  if (prior.rows() != 0 || prior.cols() != 0) {
    check_matrix(prior, parameters, "the prior information");
  }
  if (method != SelectionMethod::all) {
    check_count(*this, candidates, rows_per_pose, parameters);
  }
  check_required(*this, candidates);
  check_criterion(*this, parameters);
  demand(restarts >= 1, "restarts is ", restarts, ", expected at least 1");
  demand(kicks >= 0, "kicks is ", kicks, ", expected zero or more");
  demand(spare_count >= 0, "the spare count is ", spare_count, ", expected zero or more");
  demand(memory_limit_bytes >= 0, "the memory limit is ", memory_limit_bytes,
         " bytes, expected zero or more");
  demand(time_limit_s >= 0, "the time limit is ", time_limit_s, " s, expected zero or more");
}

}  // namespace symkin::design
