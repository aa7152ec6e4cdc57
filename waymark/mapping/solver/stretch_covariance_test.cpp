// The covariance that a drive's own stretches show, against what numbers are wrong by over many draws.
#include "waymark/mapping/solver/stretch_covariance.hpp"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr int kTerms = 640;
constexpr int kStretches = 32;
constexpr double kSigma_m = 0.0005;
constexpr double kStep_m = 0.2;

struct Drive {
  Bundle bundle{};
  StretchQuestion question{};
};

/// A straight drive along known poses. Wheels of scale 1 whose errors stay the same over so many steps; a
/// mounting of which only the prior speaks.
Drive drive(std::uint64_t seed, int steps_alike) {
  Random random(seed);
  Drive made;
  Bundle& bundle = made.bundle;
  bundle.odometry_scales.push_back({});
  made.question.pose = bundle.add({});
  made.question.stretch.push_back(-1);
  const Eigen::Vector3d sigma(kSigma_m, kSigma_m, 0.01);
  const Matrix6 of_prior = Matrix6::Identity() / 0.1;
  bundle.priors.push_back({made.question.pose, {{}, of_prior}});
  double off_m = 0;
  for (int i = 0; i <= kTerms; ++i) {
    const PoseIndex pose = bundle.add(SE3({}, {kStep_m * i, 0, 0}), true);
    made.question.stretch.push_back(i * kStretches / (kTerms + 1));
    if (i == 0) continue;
    if ((i - 1) % steps_alike == 0) off_m = random.normal(0, kSigma_m);
    const SE2 measured({}, {kStep_m + off_m, 0});
    bundle.odometry.push_back(
        {pose - 1, pose, 0, {measured, sigma.cwiseInverse().asDiagonal(), 0.1, SE2::Tangent::Zero()}});
  }
  return made;
}

/// Root mean square of the error of the distance scale in stated deviations, by stretches and by the model.
struct Scores {
  double by_stretches = 0, by_model = 0;
};

Scores scores(int steps_alike) {
  constexpr int kDraws = 200;
  Scores sum;
  for (int draw = 0; draw < kDraws; ++draw) {
    Drive made = drive(static_cast<std::uint64_t>(1000 + draw), steps_alike);
    EXPECT_TRUE(solve(made.bundle).usable());
    const auto spread = stretch_covariance(made.bundle, made.question);
    if (!spread) {
      ADD_FAILURE() << "no covariance";
      return sum;
    }
    const double off = made.bundle.odometry_scales[0].value.distance - 1;
    sum.by_stretches += off * off / spread->scales(0, 0);
    sum.by_model += off * off / covariance(made.bundle).scales[0](0, 0);
  }
  const Scores rms{std::sqrt(sum.by_stretches / kDraws), std::sqrt(sum.by_model / kDraws)};
  std::printf("errors alike over %d steps: %.2f by stretches, %.2f by the model\n", steps_alike,
              rms.by_stretches, rms.by_model);
  return rms;
}

TEST(StretchCovariance, IsThatOfTheModelWhereTheModelIsRight) {
  const Scores rms = scores(1);
  EXPECT_NEAR(rms.by_stretches, 1, 0.13);
  EXPECT_NEAR(rms.by_model, 1, 0.13);
}

TEST(StretchCovariance, HoldsWhereErrorsLast) {
  const Scores rms = scores(10);
  EXPECT_NEAR(rms.by_stretches, 1, 0.15);
  EXPECT_GT(rms.by_model, 2.5);
}

TEST(StretchCovariance, APriorCountsAsStated) {
  const Drive made = drive(7, 1);
  const auto spread = stretch_covariance(made.bundle, made.question);
  ASSERT_TRUE(spread);
  EXPECT_EQ(spread->stretches, kStretches);
  EXPECT_LT((spread->pose - 0.01 * Matrix6::Identity()).norm(), 1e-6);
  EXPECT_EQ(spread->intrinsics.size(), 0);
}

TEST(StretchCovariance, SaysNothingOfFewStretchesOrOfWhatIsKnown) {
  Drive few = drive(7, 1);
  for (int& stretch : few.question.stretch) stretch /= 8;
  EXPECT_FALSE(stretch_covariance(few.bundle, few.question));
  Drive known = drive(7, 1);
  known.bundle.poses[known.question.pose].fixed = true;
  EXPECT_FALSE(stretch_covariance(known.bundle, known.question));
}

}  // namespace
}  // namespace waymark
