// SPDX-License-Identifier: MIT
#include "symkin/design/pair_step.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace symkin {
namespace {

constexpr int kNewtonSteps = 20;

}  // namespace

PairStep::PairStep(Shape shape)
    : shape_(shape),
      pair_(2 * shape.rows, shape.parameters),
      solved_(2 * shape.rows, shape.parameters) {}

// a = (d_l - d_k) / (2 (d_l d_k - d_kl^2)).
double PairStep::single(const Information& information, const double* giver, const double* taker,
                        double limit) {
  const Index p = shape_.parameters;
  information.multiply_inverse(giver, solved_.data());
  information.multiply_inverse(taker, solved_.data() + p);
  double d_giver = 0;
  double d_taker = 0;
  double d_cross = 0;
  for (Index a = 0; a < p; ++a) {
    d_giver += giver[a] * solved_.data()[a];
    d_taker += taker[a] * solved_.data()[p + a];
    d_cross += giver[a] * solved_.data()[p + a];
  }
  const double gain = d_taker - d_giver;
  const double curvature = 2 * (d_taker * d_giver - d_cross * d_cross);
  return gain <= 0 ? 0 : gain < limit * curvature ? gain / curvature : limit;
}

// With G the 2r x 2r matrix of products and E = diag(I, -I), f(a) = log det(I + a E G) is concave:
// Newton on f', kept inside the interval where f' changes sign.
double PairStep::operator()(const Information& information, const double* giver,
                            const double* taker, double limit) {
  if (shape_.rows == 1) {
    return single(information, giver, taker, limit);
  }
  const Index r = shape_.rows;
  pair_.topRows(r) = Eigen::Map<const RowMatrix>(taker, r, shape_.parameters);
  pair_.bottomRows(r) = Eigen::Map<const RowMatrix>(giver, r, shape_.parameters);
  solved_.noalias() = pair_ * information.inverse();
  gram_.noalias() = solved_ * pair_.transpose();
  gram_.bottomRows(r) *= -1;
  if (gram_.trace() <= 0) {
    return 0;
  }
  double low = 0;
  double high = limit;
  double step = 0;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Eigen::PartialPivLU<RowMatrix> lu(RowMatrix::Identity(2 * r, 2 * r) + step * gram_);
    product_ = lu.solve(gram_);
    const double slope = product_.trace();
    const double curvature = product_.cwiseProduct(product_.transpose()).sum();
    // Beyond a singular matrix the determinant is negative and f' means nothing.
    if (lu.determinant() <= 0 || !(curvature > 0)) {
      high = step;
      step = (low + high) / 2;
      continue;
    }
    (slope > 0 ? low : high) = step;
    double next = step + slope / curvature;
    if (next >= high) {
      next = high == limit && i == 0 ? high : (low + high) / 2;
    } else if (next <= low) {
      next = (low + high) / 2;
    }
    if (std::abs(next - step) <= 1e-6 * limit) {
      return std::min(next, high);
    }
    step = next;
  }
  return low;
}

}  // namespace symkin
