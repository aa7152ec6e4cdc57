// Monte Carlo: is the estimate as good as the corners allow, and does its covariance say how good it is?
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <optional>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/tag_views.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using testing::kTagSize;
using testing::see_tag;
using testing::ViewRange;
using testing::with_noise;

/// How many times as long the Monte Carlo runs are with ./test.sh --full.
int effort() { return std::getenv("WAYMARK_FULL") == nullptr ? 1 : 5; }

struct Statistics {
  int count = 0;
  double squared_position = 0, squared_rotation = 0;  ///< of the error
  double bound_position = 0, bound_rotation = 0;  ///< Cramér-Rao: smallest possible expectation of the same
  double nees = 0;

  [[nodiscard]] double position_ratio() const { return std::sqrt(squared_position / bound_position); }
  [[nodiscard]] double rotation_ratio() const { return std::sqrt(squared_rotation / bound_rotation); }
  [[nodiscard]] double mean_nees() const { return nees / count; }
  /// Half width of the interval that holds the mean of `count` draws of a chi-square of 6 degrees with
  /// probability 0.95.
  [[nodiscard]] double nees_margin() const { return 1.96 * std::sqrt(12.0 / count); }
};

/// The solution whose rotation is nearest to the truth: the branch is not what is tested here.
const TagPoseSolution& nearest(const TagPose& pose, const SE3& truth) {
  const auto angle = [&](const TagPoseSolution& s) {
    return (s.cam_T_tag.rotation().inverse() * truth.rotation()).angle();
  };
  return pose.other && angle(*pose.other) < angle(pose.best) ? *pose.other : pose.best;
}

Statistics run(const CameraModel& camera, const ViewRange& range, double sigma_px, int count,
               std::uint64_t seed, const std::optional<CornerCovariance>& covariance = {}) {
  Random random(seed);
  Statistics sum;
  while (sum.count < count) {
    const SE3 truth = testing::random_view(random, range);
    TagDetection clean = see_tag(camera, truth).value();
    clean.corner_covariance_px2 = covariance;
    TagDetection seen = clean;
    if (covariance) {
      Eigen::Matrix<double, 8, 1> white;
      for (double& w : white.reshaped()) w = random.normal();
      const Eigen::Matrix<double, 8, 1> noise = Eigen::LLT<CornerCovariance>(*covariance).matrixL() * white;
      for (std::size_t i = 0; i < 4; ++i)
        seen.corners_px.at(i) += noise.segment<2>(static_cast<Eigen::Index>(2 * i));
    } else {
      seen = with_noise(seen, sigma_px, random);
    }
    const TagPoseOptions options{.corner_sigma_px = sigma_px};
    const auto pose = estimate_tag_pose(seen, kTagSize, camera, options);
    // Without noise the covariance is the bound (its being the inverse Fisher information is tested on its
    // own).
    const auto bound = estimate_tag_pose(clean, kTagSize, camera, options);
    EXPECT_TRUE(pose && bound);
    if (!pose || !bound) break;
    const TagPoseSolution& found = nearest(*pose, truth);
    const SE3::Tangent error = minus(truth, found.cam_T_tag);
    sum.nees += error.dot(Eigen::LLT<PoseCovariance>(found.covariance).solve(error));
    sum.squared_position += (truth.translation() - found.cam_T_tag.translation()).squaredNorm();
    sum.squared_rotation += error.tail<3>().squaredNorm();
    const auto deviations = standard_deviations(truth, bound->best.covariance);
    sum.bound_position += deviations.position_m.squaredNorm();
    sum.bound_rotation += deviations.rotation_rad.squaredNorm();
    ++sum.count;
  }
  return sum;
}

void expect_efficient_and_consistent(const char* what, const Statistics& s) {
  std::cout << what << ": RMSE / bound position " << s.position_ratio() << ", rotation " << s.rotation_ratio()
            << ", NEES " << s.mean_nees() << " (6 +- " << s.nees_margin() << ") of " << s.count << "\n";
  EXPECT_LT(s.position_ratio(), 1.1) << what;
  EXPECT_LT(s.rotation_ratio(), 1.1) << what;
  // Better than the bound can only be a mistake in the bound.
  EXPECT_GT(s.position_ratio(), 0.9) << what;
  EXPECT_GT(s.rotation_ratio(), 0.9) << what;
  EXPECT_NEAR(s.mean_nees(), 6.0, s.nees_margin()) << what;
}

constexpr ViewRange kOrdinary{.min_size_px = 40, .max_size_px = 200, .min_tilt_deg = 20, .max_tilt_deg = 70};

TEST(TagPoseStatistics, ReachesTheBoundAndKnowsIt) {
  expect_efficient_and_consistent("plain",
                                  run(testing::plain_camera(), kOrdinary, 0.1, 20000 * effort(), 11));
}

TEST(TagPoseStatistics, ThroughADistortingLens) {
  expect_efficient_and_consistent("distorted",
                                  run(testing::distorting_camera(), kOrdinary, 0.1, 10000 * effort(), 12));
}

TEST(TagPoseStatistics, ThroughAFisheye) {
  expect_efficient_and_consistent("fisheye",
                                  run(testing::fisheye_camera(), kOrdinary, 0.1, 10000 * effort(), 13));
}

TEST(TagPoseStatistics, WithCorrelatedCorners) {
  Random random(14);
  CornerCovariance A;
  for (double& entry : A.reshaped()) entry = 0.04 * random.normal();
  const CornerCovariance covariance = A * A.transpose() + 0.001 * CornerCovariance::Identity();
  expect_efficient_and_consistent(
      "correlated", run(testing::plain_camera(), kOrdinary, 0.1, 10000 * effort(), 15, covariance));
}

// Small tags seen almost from the front are the hard case: there the covariance, first order as it is, says
// too little. Measured, not wished: docs/concepts/pose.md has the table. These bounds only notice when it
// changes.
TEST(TagPoseStatistics, SmallTagsAreWorseThanTheirCovariance) {
  const ViewRange small{.min_size_px = 20, .max_size_px = 20, .min_tilt_deg = 0, .max_tilt_deg = 10};
  const Statistics s = run(testing::plain_camera(), small, 0.1, 5000 * effort(), 16);
  std::cout << "20 px, 0 to 10 deg: RMSE / bound position " << s.position_ratio() << ", rotation "
            << s.rotation_ratio() << ", NEES " << s.mean_nees() << "\n";
  EXPECT_LT(s.position_ratio(), 1.1);
  EXPECT_GT(s.mean_nees(), 6.5);
}

}  // namespace
}  // namespace waymark
