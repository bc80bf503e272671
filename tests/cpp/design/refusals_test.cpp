// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>

#include "design/small_problems.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/not_identifiable.hpp"

namespace symkin::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <typename Thrown>
std::string message(const RowMatrix& rows, const SelectionOptions& options, Index r = 1) {
  try {
    select_poses(CandidateRows{rows, r}, options);
  } catch (const Thrown& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing of this type was thrown";
  return {};
}

void expect_refusal(const RowMatrix& rows, const SelectionOptions& options,
                    const std::string& words, Index r = 1) {
  EXPECT_NE(message<InvalidInput>(rows, options, r).find(words), std::string::npos)
      << message<InvalidInput>(rows, options, r);
}

SelectionOptions six() { return options_for(6, SelectionMethod::exchange); }

// A prior may show what few poses do not; one of zeros shows nothing.
TEST(Refusals, PosesThatWithThePriorDoNotShowEveryParameterByAnyCriterion) {
  SelectionOptions options = options_for(4, SelectionMethod::exchange);
  options.prior = RowMatrix::Zero(8, 8);
  options.error_weight = RowMatrix::Identity(8, 8);
  for (const Criterion criterion : {Criterion::O1, Criterion::O2, Criterion::O3, Criterion::O4,
                                    Criterion::O5, Criterion::expected_error}) {
    options.criterion = criterion;
    const std::string text = message<NotIdentifiable>(random_rows(50, 8, 1), options);
    EXPECT_NE(text.find("does not show"), std::string::npos) << text;
  }
}

TEST(Refusals, TooFewPosesForTheParameters) {
  expect_refusal(random_rows(20, 4, 1), options_for(3, SelectionMethod::exchange),
                 "3 poses of 1 row cannot show 4 parameters; expected at least 4 poses");
  expect_refusal(random_rows(20, 3, 1), options_for(1, SelectionMethod::exchange),
                 "expected at least 2 poses", 2);
}

TEST(Refusals, MorePosesThanCandidates) {
  expect_refusal(random_rows(5, 3, 1), six(), "6 poses cannot be selected from 5 candidates");
}

TEST(Refusals, ARowThatIsNotFiniteIsNamedUnlessForbidden) {
  RowMatrix rows = random_rows(400, 3, 1);
  rows(300, 1) = kNaN;
  SelectionOptions options = six();
  expect_refusal(rows, options, "candidate 300 has a row that is not finite (parameter 1)");
  options.forbidden.assign(400, false);
  options.forbidden[300] = true;
  EXPECT_EQ(select_poses(CandidateRows{rows}, options).indices.size(), 6U);
}

TEST(Refusals, RowsThatDoNotMakeWholeCandidates) {
  expect_refusal(random_rows(20, 3, 1), six(), "20 rows do not make whole candidates of 3 rows", 3);
}

TEST(Refusals, AParameterThatNoPoseShowsIsNamedByItsDirection) {
  RowMatrix rows = random_rows(50, 4, 1);
  rows.col(3) = 2 * rows.col(1);
  try {
    select_poses(CandidateRows{rows}, six());
    FAIL() << "the rows are rank deficient";
  } catch (const NotIdentifiable& error) {
    ASSERT_EQ(error.null_directions.cols(), 1);
    EXPECT_LT((rows * error.null_directions).norm(), 1e-9);
    EXPECT_NEAR(std::abs(error.null_directions(1, 0)), 2 / std::sqrt(5.0), 1e-9);
    EXPECT_NE(std::string(error.what()).find("only 3 independent combinations of the 4"),
              std::string::npos);
  }
}

TEST(Refusals, CandidatesThatAreAllAlike) {
  const RowMatrix rows = random_rows(1, 3, 1).replicate(30, 1);
  try {
    select_poses(CandidateRows{rows}, six());
    FAIL() << "all candidates are alike";
  } catch (const NotIdentifiable& error) {
    EXPECT_EQ(error.null_directions.cols(), 2);
    EXPECT_LT((rows * error.null_directions).norm(), 1e-9);
  }
}

TEST(Refusals, NearlyDependentColumnsAreNotMistakenForDependentOnes) {
  RowMatrix rows = random_rows(60, 4, 1);
  rows.col(3) = rows.col(1) + 1e-7 * rows.col(3);
  EXPECT_TRUE(std::isfinite(select_poses(CandidateRows{rows}, six()).log_det));
}

TEST(Refusals, FewPosesOfManyRowsThatCannotShowEverything) {
  // Each pose shows one parameter of each block of four twice; two poses show four of eight.
  RowMatrix rows = RowMatrix::Zero(4 * 20, 8);
  const RowMatrix values = random_rows(4 * 20, 8, 1);
  for (Index j = 0; j < 20; ++j) {
    for (Index a = 0; a < 4; ++a) {
      rows(4 * j + a, j % 8) = values(4 * j + a, j % 8);
    }
  }
  EXPECT_NE(message<NotIdentifiable>(rows, options_for(2, SelectionMethod::exchange), 4)
                .find("select more poses"),
            std::string::npos);
}

// Equal candidates and a singular design: rounding must not exchange them for ever.
TEST(Refusals, EqualPosesThatCannotShowEverythingEndTheSearch) {
  RowMatrix rows = RowMatrix::Zero(2 * 16, 8);
  for (Index j = 0; j < 16; ++j) {
    rows(2 * j, j % 8) = 1;
    rows(2 * j + 1, j % 8) = 2;
  }
  EXPECT_NE(message<NotIdentifiable>(rows, options_for(4, SelectionMethod::exchange), 2)
                .find("the choice of 4 poses does not show 4 combinations of the 8 parameters"),
            std::string::npos);
}

TEST(Refusals, RequiredAndForbiddenAtOnce) {
  SelectionOptions options = six();
  options.required = {2};
  options.forbidden.assign(20, false);
  options.forbidden[2] = true;
  expect_refusal(random_rows(20, 3, 1), options, "candidate 2 is required and forbidden");
}

TEST(Refusals, RequiredPosesThatDoNotExistOrAppearTwiceOrAreTooMany) {
  SelectionOptions options = six();
  options.required = {20};
  expect_refusal(random_rows(20, 3, 1), options, "the required candidate 20 does not exist");
  options.required = {4, 4};
  expect_refusal(random_rows(20, 3, 1), options, "candidate 4 is required twice");
  options.required = {1, 2, 3, 4, 5, 6, 7};
  expect_refusal(random_rows(20, 3, 1), options,
                 "the number of required poses is 7, more than the count 6");
}

TEST(Refusals, RequiredPosesThatAreTooNear) {
  SelectionOptions options = six();
  options.coordinates = RowMatrix::Zero(20, 2);
  options.minimum_distance = 0.1;
  options.required = {3, 8};
  expect_refusal(random_rows(20, 3, 1), options, "the required candidates 3 and 8 are");
}

TEST(Refusals, ADistanceThatLeavesTooFewPoses) {
  SelectionOptions options = six();
  options.coordinates = RowMatrix::Zero(20, 2);
  options.minimum_distance = 0.1;
  expect_refusal(random_rows(20, 3, 1), options, "minimum distance");
}

TEST(Refusals, TooFewCandidatesAreLeftByWhatIsForbidden) {
  SelectionOptions options = six();
  options.forbidden.assign(20, true);
  for (std::size_t j = 0; j < 5; ++j) {
    options.forbidden[j] = false;
  }
  expect_refusal(random_rows(20, 3, 1), options, "only 5 candidates are neither forbidden");
}

TEST(Refusals, MatricesOfTheWrongKind) {
  SelectionOptions options = six();
  options.prior = RowMatrix::Identity(2, 2);
  expect_refusal(random_rows(20, 3, 1), options, "the prior information is 2 x 2, expected 3 x 3");
  options.prior = -RowMatrix::Identity(3, 3);
  expect_refusal(random_rows(20, 3, 1), options, "not positive semidefinite");
  options.prior = RowMatrix();
  options.criterion = Criterion::expected_error;
  expect_refusal(random_rows(20, 3, 1), options, "the error weight is 0 x 0");
}

TEST(Refusals, MethodsThatKnowOnlyTheDeterminant) {
  SelectionOptions options = six();
  options.criterion = Criterion::O3;
  options.method = SelectionMethod::exhaustive;
  expect_refusal(random_rows(20, 3, 1), options, "only criterion O1 can be proven optimal");
}

}  // namespace
}  // namespace symkin::testing
