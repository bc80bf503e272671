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

TEST(QuadraticForm, OfAnyOfTwoFallsShortOfItsQuantileAsOftenAsBothTogether) {
  const QuadraticForm small((Vector(3) << 1, 0.5, 0.2).finished());
  const QuadraticForm large((Vector(2) << 4, 3).finished());
  for (const double degrees : {kNoiseKnown, 6.5}) {
    const double found = QuadraticForm::quantile_of_any({small, large}, 0.9, degrees);
    EXPECT_GT(found, small.quantile(0.9, degrees));
    EXPECT_LT(found, large.quantile(0.9, degrees));
  }
  const double found = QuadraticForm::quantile_of_any({small, large}, 0.9);
  EXPECT_NEAR((small.tail(found) + large.tail(found)) / 2, 0.1, 1e-9);
  EXPECT_DOUBLE_EQ(QuadraticForm::quantile_of_any({small, small}, 0.9), small.quantile(0.9));
}

// Covariances one below the other, each with other directions that are known badly.
RowMatrix covariances(Index count, Index size) {
  RowMatrix rows(count * size, size);
  for (Index k = 0; k < count; ++k) {
    for (Index i = 0; i < size; ++i) {
      for (Index j = 0; j < size; ++j) {
        const double bad = std::sin(1.0 + static_cast<double>((k + 1) * (i + 1))) *
                           std::sin(1.0 + static_cast<double>((k + 1) * (j + 1)));
        rows(k * size + i, j) = (i == j ? 1.0 / static_cast<double>(1 + i) : 0) + 0.05 * bad;
      }
    }
  }
  return rows;
}

TEST(MixedQuantile, IsThatOfAnyOfTheFormsToSomeTenthsOfAPercent) {
  constexpr Index kSize = 12;
  constexpr Index kCount = 8;
  const RowMatrix given = covariances(kCount, kSize);
  const RowMatrix form = RowMatrix::Identity(kSize, kSize);
  std::vector<QuadraticForm> forms;
  for (Index k = 0; k < kCount; ++k) {
    forms.push_back(QuadraticForm::of(form, given.middleRows(k * kSize, kSize)));
  }
  for (const double probability : {0.5, 0.9, 0.95, 0.99}) {
    const double exact = QuadraticForm::quantile_of_any(forms, probability);
    EXPECT_NEAR(mixed_quantile(form, given, probability) / exact, 1, 0.01);
    const double estimated = QuadraticForm::quantile_of_any(forms, probability, 8);
    EXPECT_NEAR(mixed_quantile(form, given, probability, 8) / estimated, 1, 0.01);
  }
  // Alone the mean covariance promises too much.
  const double alone = QuadraticForm::of(form, mean_covariance(given)).quantile(0.99);
  EXPECT_LT(alone, 0.99 * QuadraticForm::quantile_of_any(forms, 0.99));
}

TEST(MixedQuantile, OfOneCovarianceIsTheQuantileOfItsForm) {
  const RowMatrix one = covariances(1, 5);
  const RowMatrix form = RowMatrix::Identity(5, 5);
  EXPECT_EQ(mixed_quantile(form, one, 0.95), QuadraticForm::of(form, one).quantile(0.95));
  EXPECT_EQ(mixed_quantile(RowMatrix::Zero(5, 5), covariances(3, 5), 0.95), 0);
  EXPECT_THROW(mixed_quantile(form, covariances(2, 5).topRows(7), 0.95), InvalidInput);
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
