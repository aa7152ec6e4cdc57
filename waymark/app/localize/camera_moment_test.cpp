// The common corner error is estimated from residuals. Adding it makes the poses consistent.
#include "waymark/app/localize/camera_moment.hpp"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr double kClaimed_px = 0.03;
constexpr int kTags = 4;

CameraModel lens() {
  return CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();
}

/// Tags at a distance of 1.5 m, each tilted differently.
TagMap wall() {
  TagMap map;
  for (int i = 0; i < kTags; ++i)
    map.tags[{FamilyId::Tag36h11, i}] = {
        .map_T_tag = {SO3::exp({0.2, 0.3 - 0.2 * i, 0.1 * i}), {0.35 * (i - 1.5), 0.1 * (i % 2), 1.5}},
        .size_m = 0.16};
  return map;
}

SE3 map_T_cam(int k) { return {SO3::exp({0.01 * k, 0, 0}), {0.01 * k - 0.1, 0.005 * k, 0}}; }

/// Images whose corner covariances claim a standard deviation of kClaimed_px, with an additional error whose
/// standard deviation is `extra_px`.
std::vector<TagFrame> images(double extra_px, int count) {
  Random random(20261128);
  std::vector<TagFrame> frames;
  const CameraModel camera = lens();
  for (int k = 0; k < count; ++k) {
    TagFrame frame{.stamp = SensorTime(std::chrono::milliseconds(33 * k))};
    for (const auto& [id, tag] : wall().tags) {
      TagDetection seen{.tag = id};
      seen.corner_covariance_px2 = kClaimed_px * kClaimed_px * CornerCovariance::Identity();
      const auto corners = square_corners(tag.size_m);
      for (std::size_t i = 0; i < 4; ++i)
        for (const int axis : {0, 1})
          seen.corners_px[i][axis] =
              (*camera.project(map_T_cam(k % 20).inverse() * (tag.map_T_tag * corners[i])))[axis] +
              random.normal(0, std::hypot(kClaimed_px, extra_px));
      frame.detections.push_back(seen);
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<PosedTags> with_true_poses(const std::vector<TagFrame>& frames) {
  std::vector<PosedTags> all;
  for (std::size_t k = 0; k < frames.size(); ++k)
    all.push_back({frames[k].detections, map_T_cam(static_cast<int>(k % 20)).inverse()});
  return all;
}

TEST(CornerError, IsEstimatedFromResiduals) {
  // With true poses there are 32 degrees of freedom per image, but the estimate assumes 6 fewer.
  const double dof_ratio = 32.0 / 26.0;
  for (const double extra_px : {0.05, 0.2, 1.0}) {
    const double estimated = common_corner_error_px(with_true_poses(images(extra_px, 200)), wall(), lens());
    const double expected =
        std::sqrt(dof_ratio * (std::pow(kClaimed_px, 2) + extra_px * extra_px) - std::pow(kClaimed_px, 2));
    EXPECT_NEAR(estimated, expected, 0.03 * expected) << extra_px;
  }
  EXPECT_EQ(common_corner_error_px({}, wall(), lens()), 0);
}

TEST(CornerError, IsZeroWithTooFewResiduals) {
  std::vector<PosedTags> one = with_true_poses(images(1, 1));
  one[0].detections.resize(3);  // the redundancy is 24 - 6 = 18
  EXPECT_EQ(common_corner_error_px(one, wall(), lens()), 0);
  one[0].detections.push_back({.tag = {FamilyId::Tag16h5, 1}});  // not in the map
  EXPECT_EQ(common_corner_error_px(one, wall(), lens()), 0);
}

TEST(CornerError, IsAddedToGivenAndDefaultCovariances) {
  TagFrame frame{.detections = std::vector<TagDetection>(2)};
  frame.detections[0].corner_covariance_px2 = 0.01 * CornerCovariance::Identity();
  const TagFrame with = with_corner_error(frame, 0.3);
  EXPECT_NEAR((*with.detections[0].corner_covariance_px2)(3, 3), 0.1, 1e-12);
  EXPECT_NEAR((*with.detections[0].corner_covariance_px2)(3, 4), 0, 1e-12);
  EXPECT_NEAR((*with.detections[1].corner_covariance_px2)(0, 0), 0.04 + 0.09, 1e-12)
      << "the default is 0.2 px";
}

TEST(CornerError, MakesRejectedPosesConsistent) {
  for (const double extra_px : {0.0, 0.3}) {
    const std::vector<TagFrame> frames = images(extra_px, 300);
    std::size_t rejected = 0;
    for (const TagFrame& frame : frames) rejected += camera_moment(frame, wall(), lens()).map_T_body ? 0 : 1;
    const auto [moments, estimated_px] = camera_moments(frames, wall(), lens(), 0);
    double nees = 0;
    std::size_t known = 0;
    for (std::size_t k = 0; k < moments.size(); ++k) {
      if (!moments[k].map_T_body) continue;
      const SE3 truth =
          map_T_cam(static_cast<int>(k % 20)) * SE3(body_R_optical().inverse(), Eigen::Vector3d::Zero());
      const SE3::Tangent off = (truth * moments[k].map_T_body->mean.inverse()).log();
      nees += off.dot(moments[k].map_T_body->covariance.llt().solve(off));
      ++known;
    }
    nees /= static_cast<double>(known);
    std::printf(
        "extra %.2f px: estimated %.3f px, %zu of 300 with a pose (singly %zu rejected), NEES %.2f of 6\n",
        extra_px, estimated_px, known, rejected, nees);
    EXPECT_GE(known, 297U);
    EXPECT_GT(nees, 5);  // the 99.9 % interval for 300 poses is 6 +- 0.66
    EXPECT_LT(nees, 7);
    EXPECT_NEAR(estimated_px, extra_px, 0.02);
    if (extra_px > 0) EXPECT_GT(rejected, 100U) << "otherwise, this test would prove nothing";
  }
}

TEST(CornerError, OfALiveCameraFollowsItsLastImages) {
  const TagMap map = wall();
  const CameraModel camera = lens();
  LiveMoments live(map, camera);
  std::size_t known = 0;
  const std::vector<TagFrame> frames = images(0.3, 600);
  for (std::size_t k = 0; k < frames.size(); ++k) known += live.of(frames[k]).map_T_body && k >= 300 ? 1 : 0;
  EXPECT_GE(known, 297U);
  EXPECT_NEAR(live.corner_error_px(), 0.3, 0.03);
  for (const TagFrame& frame : images(0, 600)) (void)live.of(frame);
  EXPECT_LT(live.corner_error_px(), 0.02) << "the estimate decreases again";
}

}  // namespace
}  // namespace waymark
