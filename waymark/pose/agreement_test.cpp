#include "waymark/pose/agreement.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {
namespace {

internal::Vote<SE2> vote(const SE2& value, double chi2 = 0) {
  return {{value, Eigen::Matrix3d::Identity() * 1e4, chi2}};
}

// Individually, two thirds of the votes prefer the wrong one of their two alternatives, but only the correct
// ones coincide.
TEST(Agreement, FindsTheAlternativeThatAllFramesShare) {
  Random random(3);
  const SE2 truth(1, 2, 0.5);
  std::vector<internal::Vote<SE2>> votes;
  for (int i = 0; i < 30; ++i) {
    const SE2 noisy =
        SE2::exp({0.01 * random.normal(), 0.01 * random.normal(), 0.01 * random.normal()}) * truth;
    const SE2 wrong = SE2(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * truth;
    internal::Vote<SE2> both = vote(wrong, i % 3 == 0 ? 2 : 0);
    both.push_back(vote(noisy, i % 3 == 0 ? 0 : 2).front());
    votes.push_back(both);
  }
  const auto agreed = internal::agree(votes, 20.0);
  ASSERT_TRUE(agreed);
  EXPECT_GE(agreed->votes, 28);
  EXPECT_LT(minus(agreed->value.mean, truth).norm(), 0.01);
  EXPECT_LT(agreed->value.covariance.trace(), 3e-5)
      << "the mean of 30 votes is more precise than a single one";
}

TEST(Agreement, OutliersBeyondTheGateAreIgnored) {
  const std::vector<internal::Vote<SE2>> votes = {vote(SE2(0, 0, 0)), vote(SE2(0, 0, 0)), vote(SE2(5, 0, 0))};
  const auto agreed = internal::agree(votes, 20.0);
  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->votes, 2);
  EXPECT_LT(agreed->value.mean.log().norm(), 1e-9);
  EXPECT_FALSE(internal::agree(std::vector<internal::Vote<SE2>>{}, 20.0));
  EXPECT_FALSE(internal::agree_near(votes, SE2(-9, 0, 0), 20.0)) << "nothing is near";
}

}  // namespace
}  // namespace waymark
