// SPDX-License-Identifier: MIT
#include "symkin/statistics/distributions.hpp"

#include <gtest/gtest.h>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// Reference: scipy.stats.ncx2.cdf and chi2.cdf.
TEST(Distributions, KeepTheirTailsFarBelowManyDegreesOfFreedom) {
  for (const double degrees : {1.0, 100.0, 4000.0, 1e6}) {
    for (const double value : {0.0, 1e-300, 1e-9, 1e-3}) {
      EXPECT_NEAR(noncentral_chi_square(value, degrees, 0), 1 - chi_square_tail(value, degrees),
                  1e-15);
    }
    EXPECT_EQ(chi_square_tail(0, degrees), 1);
    EXPECT_NEAR(chi_square_tail(chi_square_limit(degrees, 0.01), degrees), 0.01, 1e-9);
  }
}

TEST(NoncentralChiSquare, IsThatOfTheReference) {
  EXPECT_NEAR(noncentral_chi_square(3, 2, 1.5), 0.551314141393785, 1e-12);
  EXPECT_NEAR(noncentral_chi_square(150, 90, 60), 0.5166979767430112, 1e-12);
  EXPECT_NEAR(noncentral_chi_square(20, 6, 0.25), 0.9961936512184129, 1e-12);
}

TEST(NoncentralChiSquare, WithoutNoncentralityIsAChiSquare) {
  EXPECT_NEAR(noncentral_chi_square(4, 3, 0), 0.7385358700508888, 1e-12);
  EXPECT_NEAR(noncentral_chi_square(4, 3, 0), 1 - chi_square_tail(4, 3), 1e-12);
}

// Of one degree it is the normal's, on both sides of zero, of which the other is empty so far away.
TEST(NoncentralChiSquare, IsTheNormalsFarFromCentral) {
  for (const double mean : {1e3, 3.2e3, 1e4, 1e8}) {
    const double value = (mean - 1) * (mean - 1);
    EXPECT_NEAR(noncentral_chi_square(value, 1, mean * mean), 0.15865525393145707, 4e-8) << mean;
  }
}

TEST(NoncentralChiSquare, RefusesWhatHasNone) {
  EXPECT_THROW(noncentral_chi_square(1, 0, 1), InvalidInput);
  EXPECT_THROW(noncentral_chi_square(1, 2, -1), InvalidInput);
  EXPECT_THROW(noncentral_chi_square(-1, 2, 1), InvalidInput);
}

}  // namespace
}  // namespace symkin
