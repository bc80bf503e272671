// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/missing_terms.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

// What is left of a term that the parameters nearly explain is made by the errors of the poses at
// which the jacobian was taken.
constexpr double kUnexplained = 5e-3 * 5e-3;

// The columns that a QR with pivoting would take, by their inner products: the longest, then the
// one with most that those before do not span, until that is too little.
std::vector<Index> independent(RowMatrix square) {
  std::vector<Index> taken;
  while (static_cast<Index>(taken.size()) < square.rows()) {
    Index pivot = 0;
    const double most = square.diagonal().maxCoeff(&pivot);
    if (!(most > kUnexplained)) {
      break;
    }
    const Vector column = square.col(pivot);
    square.noalias() -= column * column.transpose() / most;
    square.col(pivot).setZero();
    square.row(pivot).setZero();
    taken.push_back(pivot);
  }
  return taken;
}

}  // namespace

MissingTerms::MissingTerms(const WhitenedClosures& system, const Projection& projection,
                           std::vector<RowMatrix> terms)
    : system_(system),
      projection_(projection),
      count_(terms.front().cols()),
      terms_(std::move(terms)) {
  const Vector lengths = whitened_lengths();
  for (std::size_t leg = 0; leg < terms_.size(); ++leg) {
    terms_[leg] *=
        lengths.segment(static_cast<Index>(leg) * count_, count_).cwiseInverse().asDiagonal();
    take_out_own_parameters(leg);
  }
  whiten();
  const auto legs = static_cast<Index>(terms_.size());
  by_basis_ = RowMatrix::Zero(projection_.rank(), legs * count_);
  along_ = Vector::Zero(legs * count_);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Projection::LegBlock& leg = projection_.legs()[i];
    const RowMatrix& rows = whitened_[i];
    by_basis_.bottomLeftCorner(leg.basis.cols(), rows.cols()) +=
        product(leg.basis.transpose(), rows);
    along_.head(rows.cols()) += rows.transpose() * projection_.residual()(leg.rows);
  }
}

void MissingTerms::whiten() {
  const auto legs = static_cast<Index>(terms_.size());
  for (Index i = 0; i < legs; ++i) {
    const auto rows = projection_.legs()[static_cast<std::size_t>(i)].rows.size();
    whitened_.push_back(RowMatrix::Zero(static_cast<Index>(rows), (i + 1) * count_));
  }
  std::vector<Index> next(terms_.size(), 0);  // row of each leg's block
  for (std::size_t k = 0; k < system_.poses.size(); ++k) {
    const WhitenedPose& pose = system_.poses[k];
    const RowMatrix& units = pose.units;
    const Index closures = pose.closures;
    for (std::size_t a = 0; a < pose.legs.size(); ++a) {  // whose rows
      const auto at = static_cast<std::size_t>(system_.position(pose.legs[a]));
      auto rows = whitened_[at].middleRows(next[at], closures);
      next[at] += closures;
      for (std::size_t b = 0; b <= a; ++b) {  // whose terms
        const Index of = system_.position(pose.legs[b]);
        auto own = rows.middleCols(of * count_, count_);
        const RowMatrix& terms = terms_[static_cast<std::size_t>(of)];
        for (Index i = 0; i < closures; ++i) {
          for (Index j = 0; j < closures; ++j) {
            own.row(i) +=
                units(static_cast<Index>(a) * closures + i, static_cast<Index>(b) * closures + j) *
                terms.row(pose.row * closures + j);
          }
        }
      }
      if (!projection_.counts(static_cast<Index>(k))) {
        rows.setZero();
      }
    }
  }
}

Vector MissingTerms::whitened_lengths() const {
  Vector squares = Vector::Zero(static_cast<Index>(terms_.size()) * count_);
  for (const WhitenedPose& pose : system_.poses) {
    const RowMatrix& units = pose.units;
    for (std::size_t b = 0; b < pose.legs.size(); ++b) {
      const Index of = system_.position(pose.legs[b]);
      const auto shown = units.middleCols(static_cast<Index>(b) * pose.closures, pose.closures);
      const auto own =
          terms_[static_cast<std::size_t>(of)].middleRows(pose.row * pose.closures, pose.closures);
      squares.segment(of * count_, count_) += product(shown, own).colwise().squaredNorm();
    }
  }
  return (squares.array() > 0).select(squares, 1).cwiseSqrt();
}

// The inner products of terms that the parameters nearly explain would cancel: what the leg's own
// parameters explain of them goes first, which changes no test.
void MissingTerms::take_out_own_parameters(std::size_t leg) {
  std::vector<Index> rows;  // of the leg's closures that count
  for (const Index k : projection_.legs()[leg].poses) {
    const WhitenedPose& pose = system_.poses[static_cast<std::size_t>(k)];
    for (Index i = 0; projection_.counts(k) && i < pose.closures; ++i) {
      rows.push_back(pose.row * pose.closures + i);
    }
  }
  const RowMatrix own = system_.of_legs[leg].by_parameters(kAll, system_.estimated[leg]);
  const RowMatrix counted = own(rows, kAll);
  const Vector scale = inverse_column_lengths(counted);
  const ColumnSpace space = column_space(counted * scale.asDiagonal());
  const RowMatrix onto = scale.asDiagonal() * space.coordinates;
  terms_[leg] -=
      product(own, product(onto, product(space.basis.transpose(), terms_[leg](rows, kAll))));
}

std::vector<Index> MissingTerms::columns_of(const std::vector<Index>& legs) const {
  std::vector<Index> columns;
  for (const Index leg : legs) {
    for (Index i = 0; i < count_; ++i) {
      columns.push_back(leg * count_ + i);
    }
  }
  return columns;
}

RowMatrix MissingTerms::square(const std::vector<Index>& columns) const {
  const auto n = static_cast<Index>(columns.size());
  const RowMatrix by_basis = by_basis_(kAll, columns);
  RowMatrix square = -product(by_basis.transpose(), by_basis);
  for (const RowMatrix& rows : whitened_) {
    // Columns ascend: those that the leg's rows have are the first.
    const auto shown = std::lower_bound(columns.begin(), columns.end(), rows.cols());
    const std::vector<Index> own(columns.begin(), shown);
    if (!own.empty()) {
      const RowMatrix part = rows(kAll, own);
      const auto size = static_cast<Index>(own.size());
      square.topLeftCorner(size, size) += product(part.transpose(), part);
    }
  }
  return square.topLeftCorner(n, n);
}

MissingTerms::Explained MissingTerms::explained(const std::vector<Index>& legs) const {
  const std::vector<Index> columns = columns_of(legs);
  const RowMatrix all = square(columns);
  const Vector of_all = along_(columns);
  const Vector lengths = all.diagonal();
  const std::vector<Index> taken = independent(all);
  Explained result;
  result.rank = static_cast<Index>(taken.size());
  result.alone =
      (lengths.array() > kUnexplained)
          .select(of_all.array().square() / lengths.array(), Vector::Zero(lengths.size()));
  if (taken.empty()) {
    return result;
  }
  const Vector along = of_all(taken);
  ScaledCholesky cholesky;
  cholesky.compute(all(taken, taken));
  Vector solved;
  cholesky.solve(along, solved);
  result.square = along.dot(solved);
  Vector coefficients = Vector::Zero(of_all.size());
  coefficients(taken) = solved;
  result.rms = rms(legs, coefficients);
  return result;
}

// The terms less what the parameters explain of them, unwhitened: a leg's closures have its own
// terms and its own parameters alone.
double MissingTerms::rms(const std::vector<Index>& legs, const Vector& coefficients) const {
  const Vector by_parameters =
      projection_.coordinates() * (by_basis_(kAll, columns_of(legs)) * coefficients);
  double sum = 0;
  Index count = 0;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const auto at = static_cast<std::size_t>(legs[i]);
    const Index first = system_.columns[at];
    const Index parameters = system_.columns[at + 1] - first;
    const Vector shown = terms_[at] * coefficients.segment(static_cast<Index>(i) * count_, count_) -
                         system_.of_legs[at].by_parameters(kAll, system_.estimated[at]) *
                             by_parameters.segment(first, parameters);
    for (const Index k : projection_.legs()[at].poses) {
      const WhitenedPose& pose = system_.poses[static_cast<std::size_t>(k)];
      if (projection_.counts(k)) {
        sum += shown.segment(pose.row * pose.closures, pose.closures).squaredNorm();
        count += pose.closures;
      }
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<Index>(count, 1)));
}

}  // namespace symkin
