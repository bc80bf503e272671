// SPDX-License-Identifier: MIT
#include "symkin/statistics/quadratic_form.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "statistics/promised_numbers.hpp"
#include "symkin/statistics/distributions.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

using testing::kQuadraticForms;

Vector vector_of(const testing::Numbers& numbers) {
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Index>(numbers.size()));
}

TEST(QuadraticForm, HasTheMomentsOfTheReference) {
  for (const auto& form : kQuadraticForms) {
    const QuadraticForm found(vector_of(form.weights));
    EXPECT_NEAR(found.mean() / form.mean, 1, 1e-12) << form.name;
    EXPECT_NEAR(found.effective_degrees() / form.effective, 1, 1e-12) << form.name;
  }
}

TEST(QuadraticForm, ExceedsMultiplesOfItsMeanAsOftenAsTheReference) {
  for (const auto& form : kQuadraticForms) {
    const QuadraticForm found(vector_of(form.weights));
    for (const auto& [multiple, tail] : form.tails) {
      EXPECT_NEAR(found.tail(multiple * form.mean), tail, 1e-11) << form.name << " " << multiple;
    }
  }
}

TEST(QuadraticForm, HasTheQuantilesOfTheReference) {
  for (const auto& form : kQuadraticForms) {
    const QuadraticForm found(vector_of(form.weights));
    for (const auto& [probability, quantile] : form.quantiles) {
      EXPECT_NEAR(found.quantile(probability) / quantile, 1, 1e-9) << form.name << probability;
    }
  }
}

TEST(QuadraticForm, HasTheQuantilesOfTheReferenceWhereTheNoiseIsEstimated) {
  for (const auto& form : kQuadraticForms) {
    const QuadraticForm found(vector_of(form.weights));
    for (const auto& [degrees, quantiles] : form.unknown_noise) {
      for (const auto& [probability, quantile] : quantiles) {
        EXPECT_NEAR(found.quantile(probability, degrees) / quantile, 1, 1e-9)
            << form.name << " " << degrees << " " << probability;
      }
    }
  }
}

TEST(QuadraticForm, OfEqualWeightsIsAChiSquare) {
  for (const double degrees : {1.0, 2.0, 7.0, 70.0}) {
    const QuadraticForm form(Vector::Constant(1, 2), Vector::Constant(1, degrees));
    for (const double value : {0.01 * degrees, 0.5 * degrees, degrees, 2 * degrees, 5 * degrees}) {
      const double expected = chi_square_tail(value, degrees);
      EXPECT_NEAR(form.tail(2 * value), expected, 1e-12) << degrees << " " << value;
    }
    EXPECT_NEAR(form.quantile(0.95) / (2 * chi_square_limit(degrees, 0.05)), 1, 1e-11);
  }
}

TEST(QuadraticForm, OfOneWeightOverEstimatedNoiseIsAnF) {
  const QuadraticForm form(Vector::Ones(3));
  const double bound = form.quantile(0.95, 5);
  EXPECT_NEAR(f_tail(bound / 3, 3, 5), 0.05, 1e-11);
}

TEST(QuadraticForm, OfWeightsOfBothSignsIsADifference) {
  // Two exponentials a and b: P(a - b > x) = exp(-x / mean_a) mean_a / (mean_a + mean_b).
  const QuadraticForm form((Vector(4) << 1, 1, -3, -3).finished());
  EXPECT_NEAR(form.tail(0), 0.25, 1e-12);
  EXPECT_NEAR(form.tail(4), 0.25 * std::exp(-2.0), 1e-12);
  EXPECT_NEAR(form.tail(-6), 1 - 0.75 * std::exp(-1.0), 1e-12);
  EXPECT_NEAR(QuadraticForm(-form.weights()).tail(-4), 1 - 0.25 * std::exp(-2.0), 1e-12);
}

TEST(QuadraticForm, OfAFormAndACovarianceHasTheirTraceAsMean) {
  const RowMatrix root = (RowMatrix(2, 2) << 1, 0.5, 0, 2).finished();
  const RowMatrix covariance = root * root.transpose();
  const RowMatrix form = (RowMatrix(2, 2) << 3, 1, 1, 2).finished();
  EXPECT_NEAR(QuadraticForm::of(form, covariance).mean(), (form * covariance).trace(), 1e-12);
}

TEST(QuadraticForm, OfWhatIsKnownIsZero) {
  const QuadraticForm form(Vector::Zero(3));
  EXPECT_EQ(form.quantile(0.95), 0);
  EXPECT_EQ(form.tail(0), 0);
  EXPECT_EQ(form.tail(-1), 1);
}

TEST(QuadraticForm, RefusesWhatIsNone) {
  EXPECT_THROW(QuadraticForm(Vector::Ones(2), Vector::Ones(1)), InvalidInput);
  EXPECT_THROW(QuadraticForm(Vector::Constant(1, NAN)), InvalidInput);
  EXPECT_THROW(QuadraticForm(Vector::Ones(1), Vector::Zero(1)), InvalidInput);
  EXPECT_THROW(QuadraticForm(Vector::Ones(2)).quantile(1), InvalidInput);
  EXPECT_THROW(QuadraticForm(Vector::Ones(2)).quantile(0.5, 0), InvalidInput);
  EXPECT_THROW(QuadraticForm((Vector(2) << 1, -1).finished()).quantile(0.5), InvalidInput);
  EXPECT_THROW(QuadraticForm::of(RowMatrix::Ones(2, 2), RowMatrix::Ones(3, 3)), InvalidInput);
}

}  // namespace
}  // namespace symkin
