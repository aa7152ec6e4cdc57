// A phone's video of two tags that were taped to a wall (WPIcal's field.mp4): what the map says of it against
// geometry that needs no camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/video/map_video.hpp"
#include "waymark/config/wpilib_layout.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

const TagId kThree{FamilyId::Tag36h11, 3};
const TagId kFour{FamilyId::Tag36h11, 4};

/// By the homography of both squares on one plane, for which no focal length is needed (OpenCV's
/// findHomography over the corners of 32 pictures by OpenCV's aruco module, the squares' distance and turn by
/// Gauss-Newton: 0.2 px rms; 0.5100 m without a lens model, 0.5120 m with that of testcalibration.mp4).
constexpr double kApart_m = 0.511;
constexpr double kApartSigma_m = 0.002;

/// OpenCV's calibration from testcalibration.mp4 (ChArUco, DICT_5X5_1000, 12 x 8 squares of 0.709 in, markers
/// of 0.551 in). Its board faces the camera all the time and hardly moves: 53 pictures that tell what one
/// tells, so that OpenCV's deviations are multiplied by the root of 53.
MapVideoJob field_job(const std::filesystem::path& video) {
  PinholeRadtan lens{.fx = 2124.8, .fy = 2123.8, .cx = 989.8, .cy = 537.5, .coefficients = 4};
  lens.k = {0.21398, -1.45215, 0.001403, 0.000213, 0, 0, 0, 0};
  MapVideoJob job{.videos = {video.string()}, .camera = CameraModel::make(lens, 1920, 1080).value()};
  job.intrinsics_sigma = (Eigen::VectorXd(8) << 450, 450, 13, 13, 0.087, 1.16, 0.0013, 0.0017).finished();
  job.sizes.default_size_m = kWpilibTagSize_m;
  job.anchors = {kThree};
  return job;
}

/// The detections of every picture, once.
const std::vector<SceneFrame>& field_frames(const std::filesystem::path& video) {
  static const std::vector<SceneFrame> frames = [&] {
    std::vector<SceneFrame> all;
    const Result<TagFinder> finder = make_tag_finder({.detector = "waymark"});
    const auto add = [&](const VideoFrame& picture, TagFrame& tags) -> Status {
      all.push_back({picture.stamp, {{0, std::move(tags.detections)}}});
      return {};
    };
    const CameraModel camera = field_job(video).camera;
    if (finder) static_cast<void>(find_video_tags(video.string(), *finder, &camera, {}, add));
    return all;
  }();
  return frames;
}

struct Apart {
  double distance_m = 0, sigma_m = 0;
};

Apart apart(const MapVideoReport& report) {
  const MappedTag& three = report.file.tags.tags.at(kThree);
  const MappedTag& four = report.file.tags.tags.at(kFour);
  const Eigen::Vector3d between = four.map_T_tag.translation() - three.map_T_tag.translation();
  Eigen::Matrix<double, 3, 6> J;  // of tag 3, exactly known, nothing
  J << Eigen::Matrix3d::Identity(), -SO3::hat(four.map_T_tag.translation());
  const Eigen::Vector3d along = between.normalized();
  return {between.norm(), std::sqrt(along.dot(J * *four.covariance * J.transpose() * along))};
}

TEST(FieldVideo, ItsCovarianceHoldsTheErrorOfTheCalibration) {
  WAYMARK_REAL_DATA(video, "wpical/field.mp4");
  const auto report = map_views(field_job(video), field_frames(video), {});
  ASSERT_TRUE(report) << to_string(report.error());
  const Apart found = apart(*report);
  std::printf("tags 3 and 4 are %.4f +- %.4f m apart (%.3f by geometry); chi2 per dof %.2f\n",
              found.distance_m, found.sigma_m, kApart_m, report->corner_chi2_per_dof);
  EXPECT_NEAR(found.distance_m, kApart_m, 3 * std::hypot(found.sigma_m, kApartSigma_m));
  EXPECT_LT(found.sigma_m, 0.1);
  EXPECT_GT(report->corner_chi2_per_dof, 16);
  EXPECT_THAT(report->warnings,
              ::testing::Contains(::testing::HasSubstr("is it the calibration of this camera")));
}

TEST(FieldVideo, ThatTheWallIsFlatTellsOfTheFocalLength) {
  WAYMARK_REAL_DATA(video, "wpical/field.mp4");
  MapVideoJob job = field_job(video);
  job.planes = {{kThree, kFour}};
  const auto report = map_views(job, field_frames(video), {});
  ASSERT_TRUE(report) << to_string(report.error());
  const Apart found = apart(*report);
  ASSERT_FALSE(report->map.intrinsics.empty());
  const FoundIntrinsics& lens = report->map.intrinsics.front();
  std::printf("on one wall: %.4f +- %.4f m apart, focal length %.0f +- %.0f px\n", found.distance_m,
              found.sigma_m, lens.found[0], lens.sigma[0]);
  EXPECT_NEAR(found.distance_m, kApart_m, 3 * std::hypot(found.sigma_m, kApartSigma_m));
  EXPECT_LT(found.sigma_m, 0.012);
  // Orthogonality of the plane's axes in single pictures: 1690 to 1790 px, by lens model and constraint.
  EXPECT_NEAR(lens.found[0], 1740, 50 + 2 * lens.sigma[0]);
  EXPECT_LT(lens.sigma[0], 0.7 * lens.prior_sigma[0]) << "the camera hardly moves: pictures weigh as one";
}

}  // namespace
}  // namespace waymark
