// SPDX-License-Identifier: MIT
#include "symkin/support/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace symkin {
namespace {

// One storage order for all, so that each decomposition is compiled once; and they are all in this
// unit, because the most of them share blocks of reflections.
using Eigen::MatrixXd;

// Row I and what is left of the diagonal of a weighted square, and all rows: unrolled, since a
// product of few columns is mostly loops.
template <int Columns, int I>
void add_row(const double* row, double weight, double* square) {
  using Part = Eigen::Matrix<double, I + 1, 1>;
  Eigen::Map<Part>(square + I * Columns) += (weight * row[I]) * Eigen::Map<const Part>(row);
}
template <int Columns, int... I>
[[gnu::always_inline]] inline void add_square(const double* row, double weight, double* square,
                                              std::integer_sequence<int, I...>) {
  (add_row<Columns, I>(row, weight, square), ...);
}

// And A' diag(weights) right, if there is a right side.
template <int Columns>
void weighted_square_of(const RowMatrix& matrix, const Vector& weights, const Vector* right,
                        RowMatrix& square, Vector* product) {
  using Row = Eigen::Matrix<double, Columns, 1>;
  std::array<double, Columns * Columns> sum{};
  Row along = Row::Zero();
  for (Index k = 0; k < matrix.rows(); ++k) {
    const double* const row = matrix.row(k).data();
    add_square<Columns>(row, weights[k], sum.data(), std::make_integer_sequence<int, Columns>());
    if (right != nullptr) {
      along += (weights[k] * (*right)[k]) * Eigen::Map<const Row>(row);
    }
  }
  square = Eigen::Map<const RowMatrix>(sum.data(), Columns, Columns);
  if (product != nullptr) {
    *product = along;
  }
}

void weighted_square_of(const RowMatrix& matrix, const Vector& weights, const Vector* right,
                        RowMatrix& square, Vector* product) {
  switch (matrix.cols()) {
    case 5:
      return weighted_square_of<5>(matrix, weights, right, square, product);
    case 6:
      return weighted_square_of<6>(matrix, weights, right, square, product);
    case 7:
      return weighted_square_of<7>(matrix, weights, right, square, product);
    case 8:
      return weighted_square_of<8>(matrix, weights, right, square, product);
    default:
      square = symkin::product(matrix.transpose(), weights.asDiagonal() * matrix)
                   .triangularView<Eigen::Lower>();
      if (right != nullptr) {
        product->noalias() = matrix.transpose() * weights.cwiseProduct(*right);
      }
  }
}

constexpr Index kTogether = 4;  // rows whose products are read at once

// to -= each of `count` rows, of length `width` and n apart, times its factor.
void take_rows(const double* factors, Index stride, Index count, const double* rows, Index n,
               Index width, double* __restrict to) {
  if (count == kTogether) {
    const double f[] = {factors[0], factors[stride], factors[2 * stride], factors[3 * stride]};
    for (Index j = 0; j < width; ++j) {
      to[j] = to[j] - f[0] * rows[j] - f[1] * rows[n + j] - f[2] * rows[2 * n + j] -
              f[3] * rows[3 * n + j];
    }
    return;
  }
  for (Index k = 0; k < count; ++k) {
    const double factor = factors[k * stride];
    for (Index j = 0; j < width; ++j) {
      to[j] -= factor * rows[k * n + j];
    }
  }
}

}  // namespace

SymmetricEigen symmetric_eigen(const RowMatrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Vector symmetric_eigenvalues(const RowMatrix& matrix) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

RowMatrix cholesky_factor(const RowMatrix& matrix) {
  const Eigen::LLT<MatrixXd> cholesky(matrix);
  return cholesky.info() == Eigen::Success ? RowMatrix(cholesky.matrixL()) : RowMatrix();
}

RowMatrix inverse_factor(const RowMatrix& matrix) {
  const RowMatrix factor = lower_inverse(cholesky_factor(matrix));
  return factor.allFinite() ? factor : RowMatrix();
}

void ScaledCholesky::compute(const RowMatrix& matrix, double damping) {
  const Index n = matrix.rows();
  scale_.resize(n);
  for (Index i = 0; i < n; ++i) {
    scale_[i] = matrix(i, i) > 0 ? 1 / std::sqrt(matrix(i, i)) : 1;
  }
  factor_.resize(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j <= i; ++j) {
      factor_(i, j) = matrix(i, j) * scale_[i] * scale_[j];
    }
    factor_(i, i) += damping;
  }
  least_pivot_ = std::numeric_limits<double>::infinity();
  // Columns side by side, taken from the rest at once: sums of products one by one would wait for
  // each other. The mirror has a column's numbers side by side.
  for (Index first = 0; first < n; first += kTogether) {
    const Index end = std::min(first + kTogether, n);
    for (Index k = first; k < end; ++k) {
      double* const column = factor_.data() + k * n;
      const double pivot = column[k];
      if (!(pivot > 0)) {
        least_pivot_ = 0;
        return;
      }
      least_pivot_ = std::min(least_pivot_, pivot);
      column[k] = 1 / std::sqrt(pivot);
      for (Index i = k + 1; i < n; ++i) {
        double* const row = factor_.data() + i * n;
        const double value = row[k] = column[i] = row[k] * column[k];
        for (Index j = k + 1; j < std::min(end, i + 1); ++j) {
          row[j] -= value * column[j];
        }
      }
    }
    for (Index i = end; i < n; ++i) {
      double* const row = factor_.data() + i * n;
      take_rows(row + first, 1, end - first, factor_.data() + first * n + end, n, i + 1 - end,
                row + end);
    }
  }
}

void ScaledCholesky::forwards(Vector& vector) const {
  const Index n = scale_.size();
  for (Index i = 0; i < n; ++i) {
    const double* const row = factor_.data() + i * n;
    double value = vector[i] * scale_[i];
    for (Index k = 0; k < i; ++k) {
      value -= row[k] * vector[k];
    }
    vector[i] = value * row[i];
  }
}

void ScaledCholesky::solve(const Vector& right, Vector& solution) const {
  const Index n = scale_.size();
  solution = right;
  forwards(solution);
  for (Index i = n - 1; i >= 0; --i) {
    const double* const row = factor_.data() + i * n;
    const double value = solution[i] * row[i];
    for (Index k = 0; k < i; ++k) {
      solution[k] -= row[k] * value;
    }
    solution[i] = value * scale_[i];
  }
}

double ScaledCholesky::inverse_form(const Vector& vector) const {
  Vector half = vector;
  forwards(half);
  return half.squaredNorm();
}

RowMatrix ScaledCholesky::inverse() const {
  const Index n = scale_.size();
  RowMatrix half = RowMatrix::Zero(n, n);  // the factor's inverse: its transpose times itself
  for (Index i = 0; i < n; ++i) {
    double* const row = half.data() + i * n;
    for (Index k = 0; k < i; k += kTogether) {
      const Index end = std::min(k + kTogether, i);
      take_rows(&factor_(i, k), 1, end - k, half.data() + k * n, n, end, row);
    }
    half.row(i).head(i) *= factor_(i, i);
    row[i] = factor_(i, i);
  }
  RowMatrix inverse = RowMatrix::Zero(n, n);  // with the opposite sign until it is scaled
  for (Index i = 0; i < n; ++i) {
    for (Index k = i; k < n; k += kTogether) {
      take_rows(&half(k, i), n, std::min(kTogether, n - k), half.data() + k * n, n, i + 1,
                inverse.data() + i * n);
    }
    for (Index j = 0; j <= i; ++j) {
      inverse(i, j) = inverse(j, i) = -inverse(i, j) * scale_[i] * scale_[j];
    }
  }
  return inverse;
}

void weighted_square(const RowMatrix& matrix, const Vector& weights, RowMatrix& square) {
  weighted_square_of(matrix, weights, nullptr, square, nullptr);
}

void weighted_square(const RowMatrix& matrix, const Vector& weights, const Vector& right,
                     RowMatrix& square, Vector& product) {
  weighted_square_of(matrix, weights, &right, square, &product);
}

double log_determinant(const RowMatrix& factor) {
  return -2 * factor.diagonal().array().log().sum();
}

// With matrix = F^T F, the orthogonal Q of F = Q T is taken off from the last column backwards.
RowMatrix lower_root(const RowMatrix& matrix) {
  const SymmetricEigen eigen = symmetric_eigen(matrix);
  const RowMatrix root =
      eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  return triangular_factor(root.rowwise().reverse()).reverse();
}

RowMatrix lower_inverse(const RowMatrix& lower) {
  return lower_solution(lower, RowMatrix::Identity(lower.rows(), lower.cols()));
}

std::optional<RowMatrix> clear_null_space(const RowMatrix& matrix, double least) {
  constexpr double kRounding = 1e-13;
  const Index n = matrix.rows();
  const Vector diagonal = matrix.diagonal();
  const Vector scale = (diagonal.array() > 0).select(diagonal, 1).cwiseSqrt().cwiseInverse();
  RowMatrix rest = scale.asDiagonal() * matrix * scale.asDiagonal();
  rest.triangularView<Eigen::StrictlyUpper>() = rest.transpose();
  RowMatrix upper = RowMatrix::Zero(n, n);  // rows of the factor, columns of the matrix
  std::vector<Index> pivots, others(static_cast<std::size_t>(n));
  std::iota(others.begin(), others.end(), Index{0});
  while (!others.empty()) {
    const auto largest = std::max_element(
        others.begin(), others.end(), [&](Index i, Index j) { return rest(i, i) < rest(j, j); });
    const Index k = *largest;
    if (!(rest(k, k) > least)) {
      if (!(rest(k, k) < kRounding)) {
        return std::nullopt;
      }
      break;
    }
    const auto row = static_cast<Index>(pivots.size());
    upper.row(row) = rest.row(k) / std::sqrt(rest(k, k));
    pivots.push_back(k);
    others.erase(largest);
    for (const Index i : others) {
      rest.row(i) -= upper(row, i) * upper.row(row);
    }
  }
  RowMatrix null = RowMatrix::Zero(n, static_cast<Index>(others.size()));
  for (Index j = 0; j < null.cols(); ++j) {
    const Index other = others[static_cast<std::size_t>(j)];
    null(other, j) = 1;
    for (std::size_t k = pivots.size(); k-- > 0;) {
      const auto row = static_cast<Index>(k);
      double value = upper(row, other);
      for (std::size_t i = k + 1; i < pivots.size(); ++i) {
        value += upper(row, pivots[i]) * null(pivots[i], j);
      }
      null(pivots[k], j) = -value / upper(row, pivots[k]);
    }
  }
  return scale.asDiagonal() * null;
}

Vector inverse_column_lengths(const RowMatrix& matrix) {
  const Vector lengths = matrix.colwise().norm();
  return (lengths.array() > 0).select(lengths, 1).cwiseInverse();
}

SymmetricInverse symmetric_inverse(const RowMatrix& matrix) {
  const SymmetricEigen eigen = symmetric_eigen(matrix);
  const Index n = matrix.rows();
  const double least = static_cast<double>(n) * std::numeric_limits<double>::epsilon() *
                       eigen.values.cwiseAbs().maxCoeff();
  const Index rank = (eigen.values.array() > least).count();
  const RowMatrix half = eigen.vectors.rightCols(rank) *
                         eigen.values.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  return {product(half, half.transpose()), rank};
}

RowMatrix product(ConstRows left, ConstRows right) { return left * right; }

RowMatrix lower_solution(const RowMatrix& lower, ConstRows right) {
  MatrixXd result = right;
  MatrixXd(lower).triangularView<Eigen::Lower>().solveInPlace(result);
  return result;
}

double determinant(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<MatrixXd>(matrix).determinant();
}

RowMatrix inverse(const RowMatrix& matrix) {
  return Eigen::PartialPivLU<MatrixXd>(matrix).inverse();
}

Vector solution(const RowMatrix& matrix, const Vector& right) {
  return Eigen::PartialPivLU<MatrixXd>(matrix).solve(right);
}

RowMatrix triangular_factor(const RowMatrix& matrix) {
  const Eigen::HouseholderQR<MatrixXd> qr(matrix);
  return qr.matrixQR().topRows(matrix.cols()).triangularView<Eigen::Upper>();
}

RightSingular right_singular(const RowMatrix& matrix) {
  const Eigen::JacobiSVD<MatrixXd> svd(matrix, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

Vector singular_values(const RowMatrix& matrix) {
  return Eigen::JacobiSVD<MatrixXd>(matrix).singularValues();
}

ColumnSpace column_space(const RowMatrix& matrix, double least_pivot) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(matrix);
  const Vector pivots = qr.matrixR().diagonal().cwiseAbs();
  const Index rank = least_pivot > 0 ? (pivots.array() > least_pivot).count() : qr.rank();
  MatrixXd inverse_r = MatrixXd::Identity(rank, rank);
  qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(inverse_r);
  MatrixXd coordinates = MatrixXd::Zero(matrix.cols(), rank);
  coordinates.topRows(rank) = inverse_r;
  return {qr.householderQ() * MatrixXd::Identity(matrix.rows(), rank),
          qr.colsPermutation() * coordinates};
}

PseudoInverse pseudo_inverse(const RowMatrix& matrix, double threshold) {
  const Index m = matrix.rows();
  const Index n = matrix.cols();
  if (m == 0) {  // Eigen reads past the end of a matrix without rows
    return {RowMatrix(n, 0), RowMatrix(0, 0)};
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(threshold);
  qr.compute(matrix);
  const Index rank = qr.rank();
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(m, m);
  MatrixXd solved = q.leftCols(rank).transpose();
  if (rank == n) {
    qr.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>().solveInPlace(solved);
  } else {
    const RowMatrix top = qr.matrixR().topRows(rank).triangularView<Eigen::Upper>();
    const RowMatrix gram = product(top, top.transpose());
    solved = product(top.transpose(), product(inverse(gram), solved));
  }
  return {qr.colsPermutation() * solved, q.rightCols(m - rank)};
}

Reflections::Reflections(const RowMatrix& matrix, double threshold) {
  if (matrix.size() == 0) {  // see above
    return;
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(threshold);
  qr.compute(matrix);
  rank_ = qr.rank();
  vectors_ = qr.matrixQR();
  factors_ = qr.hCoeffs();
}

void Reflections::apply(RowMatrix& matrix) const {
  for (Index k = factors_.size(); k-- > 0;) {
    reflect(k, matrix);
  }
}

void Reflections::apply_transpose(RowMatrix& matrix) const {
  for (Index k = 0; k < factors_.size(); ++k) {
    reflect(k, matrix);
  }
}

// Less `factor` v (v' matrix) of v = (1, what is below the diagonal).
void Reflections::reflect(Index k, RowMatrix& matrix) const {
  const Index below = vectors_.rows() - k - 1;
  const auto v = vectors_.col(k).tail(below);
  auto rest = matrix.bottomRows(below);
  Eigen::RowVectorXd along = matrix.row(k);
  along.noalias() += v.transpose() * rest;
  along *= factors_[k];
  matrix.row(k) -= along;
  rest.noalias() -= v * along;
}

Vector least_squares(const RowMatrix& matrix, const Vector& right, double threshold) {
  return pseudo_inverse(matrix, threshold).matrix * right;
}

}  // namespace symkin
