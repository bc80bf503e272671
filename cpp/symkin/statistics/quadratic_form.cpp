// SPDX-License-Identifier: MIT
#include "symkin/statistics/quadratic_form.hpp"

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <complex>
#include <cstdint>
#include <string>

#include "symkin/statistics/distributions.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

using Complex = std::complex<double>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNothing = 1e-15;    // of the largest weight
constexpr double kStep = 0.06;        // of the trapezoidal rule
constexpr double kNegligible = 50.0;  // e-folds below the saddlepoint
constexpr int kDigits = 48;           // bits of a quantile

// The cumulant generating function K(t) = -1/2 sum h log(1 - 2 w t), and its derivatives, on the
// real line between its poles and above it.
struct Cumulants {
  const Vector& weights;
  const Vector& degrees;

  double first(double t) const {
    return (degrees.array() * weights.array() / (1 - 2 * t * weights.array())).sum();
  }
  double second(double t) const {
    return 2 * (degrees.array() * (weights.array() / (1 - 2 * t * weights.array())).square()).sum();
  }
  Complex value(Complex t) const {
    Complex sum = 0;
    for (Index i = 0; i < weights.size(); ++i) {
      sum -= 0.5 * degrees[i] * std::log(1.0 - 2.0 * weights[i] * t);
    }
    return sum;
  }
};

// t between `low` and `high`, where K' rises from below `value` to above it, with K'(t) = value.
double saddlepoint(const Cumulants& cumulants, double value, double low, double high) {
  double t = std::clamp(0.0, low + (high - low) * 1e-3, high - (high - low) * 1e-3);
  for (int k = 0; k < 200; ++k) {
    const double above = cumulants.first(t) - value;
    (above > 0 ? high : low) = t;
    const double newton = t - above / cumulants.second(t);
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - t) <= 1e-12 * std::abs(next) || next == t) {
      return next;
    }
    t = next;
  }
  return t;
}

// Probability that the form exceeds a value that is not negative: weights scaled to a largest of
// one, some above zero. The contour bends away from the oscillations that a value above zero
// brings.
double scaled_tail(const Cumulants& cumulants, double value) {
  constexpr double kLast = 40;
  const double least = cumulants.weights.minCoeff();
  const double high = 0.5 / cumulants.weights.maxCoeff();
  const double low = least > 0 ? -cumulants.degrees.sum() / value : 0.5 / least;
  double t0 = saddlepoint(cumulants, value, low, high);
  double width = std::min(1 / std::sqrt(cumulants.second(t0)), high - t0);
  if (std::abs(t0) < width / 2) {
    t0 = std::min(width / 2, high / 2);  // away from the pole at zero
    width = std::min(width, high - t0);
  }
  if (least < 0) {
    width = std::min(width, t0 - low);
  }
  const double bend = value > 0 ? 1 : 0;
  const double height = (cumulants.value(t0) - t0 * value).real();
  double sum = 0;
  for (double v = kStep / 2; v < kLast; v += kStep) {
    const Complex t = t0 + width * Complex(bend * (std::cosh(v) - 1), std::sinh(v));
    const Complex slope = width * Complex(bend * std::sinh(v), std::cosh(v));
    const Complex exponent = cumulants.value(t) - t * value;
    sum += (std::exp(exponent) * slope / (Complex(0, kPi) * t)).real();
    if (exponent.real() < height - kNegligible) {
      break;
    }
  }
  return std::clamp(kStep * sum + (t0 < 0 ? 1 : 0), 0.0, 1.0);
}

double tail_of(const Vector& weights, const Vector& degrees, double value) {
  const double scale = weights.size() > 0 ? weights.cwiseAbs().maxCoeff() : 0;
  if (std::isnan(value)) {
    return value;
  }
  if (scale == 0) {
    return value < 0 ? 1 : 0;
  }
  if (std::isinf(value) || (weights.minCoeff() > 0 && value <= 0)) {
    return value > 0 ? 0 : 1;
  }
  if (weights.maxCoeff() < 0 || value < 0) {
    return 1 - tail_of(-weights, degrees, -value);
  }
  const Vector scaled = weights / scale;
  return scaled_tail({scaled, degrees}, value / scale);
}

Vector without_zeros(const Vector& weights, const Vector& wanted) {
  const double least = weights.size() > 0 ? kNothing * weights.cwiseAbs().maxCoeff() : 0;
  Vector kept(weights.size());
  Index count = 0;
  for (Index i = 0; i < weights.size(); ++i) {
    if (std::abs(weights[i]) > least) {
      kept[count++] = wanted[i];
    }
  }
  return kept.head(count);
}

// A multiple of a chi-square with the mean and the variance of the form.
QuadraticForm of_two_moments(ConstRows mean_square, ConstRows covariance) {
  const RowMatrix turned = product(mean_square, covariance);
  const double first = turned.trace();
  const double second = turned.cwiseProduct(turned.transpose()).sum();
  if (!(first > 0 && second > 0)) {
    return QuadraticForm(Vector(0));
  }
  return {Vector::Constant(1, second / first), Vector::Constant(1, first * first / second)};
}

}  // namespace

QuadraticForm::QuadraticForm(const Vector& weights)
    : QuadraticForm(weights, Vector::Ones(weights.size())) {}

QuadraticForm::QuadraticForm(const Vector& weights, const Vector& degrees) {
  if (weights.size() != degrees.size()) {
    throw InvalidInput("there are " + std::to_string(weights.size()) + " weights and " +
                       std::to_string(degrees.size()) + " degrees; expected one for each");
  }
  if (!weights.allFinite() || !degrees.allFinite() || (degrees.array() <= 0).any()) {
    throw InvalidInput("a quadratic form has finite weights, and degrees above zero");
  }
  weights_ = without_zeros(weights, weights);
  degrees_ = without_zeros(weights, degrees);
}

QuadraticForm QuadraticForm::of(ConstRows mean_square, ConstRows covariance) {
  const Index size = covariance.rows();
  if (covariance.cols() != size || mean_square.rows() != size || mean_square.cols() != size) {
    throw InvalidInput("the form is " + std::to_string(mean_square.rows()) + " x " +
                       std::to_string(mean_square.cols()) + " and the covariance " +
                       std::to_string(size) + " x " + std::to_string(covariance.cols()) +
                       "; expected squares of one size");
  }
  if (!mean_square.allFinite() || !covariance.allFinite()) {
    throw InvalidInput("a form or a covariance is not finite");
  }
  const RowMatrix root = lower_root(covariance);
  const RowMatrix inner = product(product(root, mean_square), root.transpose());
  return QuadraticForm(symmetric_eigenvalues(inner).cwiseMax(0));
}

double QuadraticForm::mean() const { return weights_.dot(degrees_); }

double QuadraticForm::effective_degrees() const {
  const double squares = weights_.cwiseAbs2().dot(degrees_);
  return squares > 0 ? mean() * mean() / squares : 0;
}

double QuadraticForm::tail(double value) const { return tail_of(weights_, degrees_, value); }

// P(form > value chi^2_n / n) = P(form - (value / n) chi^2_n > 0).
double QuadraticForm::tail_over_noise(double value, double noise_degrees) const {
  if (std::isinf(noise_degrees)) {
    return tail(value);
  }
  Vector weights(weights_.size() + 1);
  Vector degrees(weights.size());
  weights << weights_, -value / noise_degrees;
  degrees << degrees_, noise_degrees;
  return tail_of(weights, degrees, 0);
}

double QuadraticForm::quantile(double probability, double noise_degrees) const {
  return quantile_of_any({*this}, probability, noise_degrees);
}

double QuadraticForm::quantile_of_any(const std::vector<QuadraticForm>& forms, double probability,
                                      double noise_degrees) {
  if (!(probability > 0 && probability < 1)) {
    throw InvalidInput("the probability is " + std::to_string(probability) +
                       "; expected one between 0 and 1");
  }
  if (!(noise_degrees > 0)) {
    throw InvalidInput("the noise has " + std::to_string(noise_degrees) +
                       " degrees of freedom; expected more than 0");
  }
  // Weights of any size: their squares and sums neither overflow nor vanish.
  double scale = 0;
  for (const QuadraticForm& form : forms) {
    if (form.weights_.size() > 0) {
      scale = std::max(scale, form.weights_.maxCoeff());
      if (form.weights_.minCoeff() < 0) {
        throw InvalidInput("a quadratic form with weights of both signs has no quantile here");
      }
    }
  }
  if (scale == 0) {
    return 0;
  }
  std::vector<QuadraticForm> scaled;
  double mean = 0, degrees = 0;
  const auto count = static_cast<double>(forms.size());
  for (const QuadraticForm& form : forms) {
    scaled.emplace_back(form.weights_ / scale, form.degrees_);
    mean += scaled.back().mean() / count;
    degrees += scaled.back().effective_degrees() / count;
  }
  const double wanted = 1 - probability;
  // Of the logarithm, in which both tails are smooth; its zero is the quantile.
  const auto excess = [&](double log_value) {
    double tail = 0;
    for (const QuadraticForm& form : scaled) {
      tail += form.tail_over_noise(std::exp(log_value), noise_degrees) / count;
    }
    return std::log(std::max(tail, 1e-300) / wanted) -
           std::log(std::max(1 - tail, 1e-300) / probability);
  };
  const double start = mean * chi_square_limit(degrees, wanted) / degrees;
  std::uintmax_t most = 200;
  const auto [low, high] = boost::math::tools::bracket_and_solve_root(
      [&](double factor) { return excess(std::log(start * factor)); }, 1.0, 1.5, false,
      boost::math::tools::eps_tolerance<double>(kDigits), most);
  return scale * start * (low + high) / 2;
}

RowMatrix mean_covariance(ConstRows covariances) {
  const Index size = covariances.cols();
  const Index count = size > 0 ? covariances.rows() / size : 0;
  if (count == 0 || covariances.rows() != count * size) {
    throw InvalidInput("the covariances are " + std::to_string(covariances.rows()) + " x " +
                       std::to_string(size) + "; expected squares, one below the other");
  }
  RowMatrix mean = covariances.topRows(size);
  for (Index k = 1; k < count; ++k) {
    mean += covariances.middleRows(k * size, size);
  }
  return mean / static_cast<double>(count);
}

double mixed_quantile(ConstRows mean_square, ConstRows covariances, double probability,
                      double noise_degrees) {
  const RowMatrix mean = mean_covariance(covariances);
  const Index size = mean.rows();
  const Index count = covariances.rows() / size;
  const QuadraticForm form = QuadraticForm::of(mean_square, mean);
  const double quantile = form.quantile(probability, noise_degrees);
  if (count == 1 || quantile == 0) {
    return quantile;
  }
  std::vector<QuadraticForm> each;
  for (Index k = 0; k < count; ++k) {
    each.push_back(of_two_moments(mean_square, covariances.middleRows(k * size, size)));
  }
  return quantile * QuadraticForm::quantile_of_any(each, probability, noise_degrees) /
         of_two_moments(mean_square, mean).quantile(probability, noise_degrees);
}

}  // namespace symkin
