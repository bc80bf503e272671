// SPDX-License-Identifier: MIT
#include "symkin/design/whitening.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>

#include "symkin/design/counted.hpp"
#include "symkin/design/information.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/not_identifiable.hpp"
#include "symkin/support/null_directions.hpp"

namespace symkin {
namespace {

constexpr double kRankTolerance = 1e-10;  // of the largest singular value
constexpr double kRounding = 1e-14;       // of the longest column: no unit makes one so short
// Squaring the rows into an information matrix keeps this ratio of singular values to six digits.
constexpr double kSafeEigenvalueRatio = 1e-10;

// An R (p x p) with R^T R the whole information, by orthogonal maps alone: no squaring.
RowMatrix orthogonal_factor(const CandidateBlocks& candidates, const RowMatrix& fixed) {
  const Shape shape = candidates.shape();
  const Index p = shape.parameters;
  const Eigen::SelfAdjointEigenSolver<RowMatrix> eigen(fixed);
  RowMatrix r =
      eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
  Eigen::MatrixXd stack(p + shape.rows * kBlock, p);
  for (Index first = 0; first < candidates.size(); first += kBlock) {
    check_interrupt();
    stack.setZero();
    stack.topRows(p) = r;
    for (Index lane = 0; lane < std::min(kBlock, candidates.size() - first); ++lane) {
      if (!candidates.excluded(first + lane)) {
        stack.middleRows(p + lane * shape.rows, shape.rows) = candidates.rows(first + lane);
      }
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(stack);
    r = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  }
  return r;
}

[[noreturn]] void refuse(const Eigen::JacobiSVD<Eigen::MatrixXd>& svd, const Vector& lengths,
                         Index rank) {
  const Index p = lengths.size();
  throw NotIdentifiable(
      "the candidates show only " + counted(rank, "independent combination") + " of the " +
          std::to_string(p) + " parameters; no choice of poses can identify the others",
      named_directions(svd.matrixV().rightCols(p - rank), lengths.cwiseInverse()));
}

// T from R, for candidates that are nearly or wholly rank deficient.
RowMatrix careful_transform(const CandidateBlocks& candidates, const RowMatrix& fixed) {
  const Eigen::MatrixXd r = orthogonal_factor(candidates, fixed);
  const Index p = r.cols();
  Eigen::MatrixXd scaled = r;
  Vector lengths = r.colwise().norm();
  const double nothing = kRounding * lengths.maxCoeff();
  for (Index c = 0; c < p; ++c) {
    if (lengths[c] <= nothing) {
      scaled.col(c).setZero();
      lengths[c] = 1;
    }
  }
  scaled *= lengths.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullV);
  const Vector& s = svd.singularValues();
  const Index rank = s[0] > 0 ? (s.array() > kRankTolerance * s[0]).count() : 0;
  if (rank < p) {
    refuse(svd, lengths, rank);
  }
  // R^T is the Cholesky factor up to the signs of its columns.
  const RowMatrix lower = r.transpose();
  RowMatrix transform = RowMatrix::Identity(p, p);
  lower.triangularView<Eigen::Lower>().solveInPlace(transform);
  for (Index a = 0; a < p; ++a) {
    transform.row(a) *= transform(a, a) < 0 ? -1.0 : 1.0;
  }
  return transform;
}

}  // namespace

Whitening whiten(const CandidateBlocks& candidates, const RowMatrix& fixed) {
  RowMatrix total = candidates.information();
  total.triangularView<Eigen::StrictlyUpper>() = total.transpose();
  total += fixed;
  Vector lengths = total.diagonal().cwiseSqrt();
  lengths = (lengths.array() > 0).select(lengths, 1);
  const Vector inverse_lengths = lengths.cwiseInverse();
  const RowMatrix scaled = inverse_lengths.asDiagonal() * total * inverse_lengths.asDiagonal();
  const Vector eigenvalues =
      Eigen::SelfAdjointEigenSolver<RowMatrix>(scaled, Eigen::EigenvaluesOnly).eigenvalues();

  Whitening result;
  const Index p = total.rows();
  if (eigenvalues[0] > kSafeEigenvalueRatio * eigenvalues[p - 1]) {
    result.transform = inverse_factor(scaled) * inverse_lengths.asDiagonal();
  } else {
    result.transform = careful_transform(candidates, fixed);
  }
  result.transform *= std::sqrt(static_cast<double>(std::max<Index>(1, candidates.available())));
  result.log_det = log_determinant(result.transform);
  return result;
}

}  // namespace symkin
