// Tests reading a user's description of a camera: file, name, image size, shutter.
#include "waymark/app/common/camera_description.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

CameraModel pose_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();
}

/// A 0.2 m tag two metres ahead, slightly rotated.
SE3 true_pose() { return {SO3::from_rpy(0.2, 0.5, 0.1), {0.1, -0.2, 2}}; }

TagDetection seen(int number, double size_m = 0.2) {
  TagDetection detection{.tag = {FamilyId::Tag36h11, number}};
  detection.corners_px = visible_corners(pose_camera(), true_pose(), size_m).value();
  return detection;
}

TEST(ParseTagSizes, ReadsADefaultAndSizesById) {
  const auto sizes = parse_tag_sizes({"0.16", "7=0.08", "tag25h9:3=0.2"});
  ASSERT_TRUE(sizes) << to_string(sizes.error());
  EXPECT_EQ(sizes->size_m({FamilyId::Tag36h11, 1}).value(), 0.16);
  EXPECT_EQ(sizes->size_m({FamilyId::Tag36h11, 7}).value(), 0.08);
  EXPECT_EQ(sizes->size_m({FamilyId::Tag25h9, 3}).value(), 0.2);
  const auto some = parse_tag_sizes({"7=0.08"});
  ASSERT_TRUE(some);
  EXPECT_FALSE(some->size_m({FamilyId::Tag36h11, 1})) << "there is no size for other tags";
  EXPECT_EQ(parse_tag_sizes({"0.1", "7=0.2", "0.1", "7=0.2"})->default_size_m, 0.1);
  for (const auto& two : std::vector<std::vector<std::string>>{{"0.1", "0.2"}, {"7=0.1", "tag36h11:7=0.2"}})
    EXPECT_EQ(parse_tag_sizes(two).error().place.key, "tag_size_m") << "contradicting sizes";
  EXPECT_TRUE(parse_tag_sizes({}));
}

TEST(ParseTagSizes, ANumberRefersToTheFamilyThatIsSearchedFor) {
  const std::vector<FamilyId> one = {FamilyId::TagStandard41h12};
  const auto sizes = parse_tag_sizes({"0.16", "0=0.08"}, one);
  ASSERT_TRUE(sizes) << to_string(sizes.error());
  EXPECT_EQ(sizes->size_m({FamilyId::TagStandard41h12, 0}).value(), 0.08);
  EXPECT_EQ(sizes->size_m({FamilyId::Tag36h11, 0}).value(), 0.16);
  const auto other = parse_tag_sizes({"tag36h11:0=0.08"}, one);
  ASSERT_FALSE(other) << "such a tag cannot be found";
  EXPECT_EQ(other.error().place.key, "tag_size_m");
  const std::vector<FamilyId> two = {FamilyId::Tag36h11, FamilyId::Tag25h9};
  const auto both = parse_tag_sizes({"7=0.08"}, two);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().hint, HasSubstr("tag36h11:7"));
  EXPECT_THAT(both.error().hint, HasSubstr("tag25h9:7"));
  EXPECT_TRUE(parse_tag_sizes({"tag25h9:7=0.08"}, two));
  EXPECT_EQ(tag_named("7", "anchor", one)->family, FamilyId::TagStandard41h12);
  EXPECT_FALSE(tags_named({"3,4"}, "floor", two));
}

TEST(ParseTagSizes, AnInvalidSizeIsReportedWithItsFieldAndText) {
  for (const char* word :
       {"", "x", "0", "-0.1", "nan", "inf", "0.16m", "7=", "=0.1", "7=0.1=2", "tag1=0.1"}) {
    const auto sizes = parse_tag_sizes({word});
    ASSERT_FALSE(sizes) << word;
    EXPECT_FALSE(sizes.error().message.empty());
  }
  const auto error = parse_tag_sizes({"7=large"}).error();
  EXPECT_EQ(error.place.key, "tag_size_m");
  EXPECT_THAT(error.message, HasSubstr("7=large"));
}

TEST(PosesOf, EachDetectionHasAPoseOrAnError) {
  const PoseSetup setup{pose_camera(), parse_tag_sizes({"7=0.2"}).value()};
  const std::vector<TagDetection> detections = {seen(3), seen(7)};
  const PoseList poses = poses_of(detections, setup);
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_FALSE(poses[0]) << "its size is unknown";
  ASSERT_TRUE(poses[1]) << to_string(poses[1].error());
  EXPECT_LT((poses[1]->best.cam_T_tag.translation() - true_pose().translation()).norm(), 1e-6);
  const auto axes = axes_of(detections, poses, setup);
  ASSERT_EQ(axes.size(), 1U) << "only where there is a pose";
  const auto middle = pose_camera().project(true_pose().translation());
  ASSERT_TRUE(middle);
  EXPECT_LT((axes[0].origin_px - *middle).norm(), 1e-3);
  EXPECT_GT((axes[0].x_px - axes[0].origin_px).norm(), 10);
}

TEST(PosesOf, PosesThatDoNotFitTheirCornersAreCounted) {
  const PoseSetup setup{pose_camera(), {.default_size_m = 0.2}};
  TagDetection wrong = seen(1);
  wrong.corner_covariance_px2 = 0.01 * CornerCovariance::Identity();
  EXPECT_EQ(count_misfits(poses_of(std::vector{wrong}, setup)), 0U);
  wrong.corners_px[2] += Eigen::Vector2d(6, 4);
  EXPECT_EQ(count_misfits(poses_of(std::vector{wrong, seen(2)}, setup)), 1U);
}

TEST(PosesOf, AWrongSizeScalesTheDistance) {
  const PoseSetup setup{pose_camera(), {.default_size_m = 0.4}};
  const std::vector<TagDetection> detections = {seen(1)};
  const PoseList poses = poses_of(detections, setup);
  ASSERT_TRUE(poses[0]);
  EXPECT_NEAR(poses[0]->best.cam_T_tag.translation().norm(), 2 * true_pose().translation().norm(), 1e-6);
}

TEST(PoseJson, ContainsThePoseOrTheError) {
  const std::vector<TagDetection> detections = {seen(1)};
  const auto known = to_json(pose_fields(poses_of(detections, {pose_camera(), {.default_size_m = 0.2}})[0]));
  EXPECT_NEAR(known["pose"]["cam_t_tag_m"][2].get<double>(), 2, 1e-6);
  EXPECT_EQ(known["pose"]["cam_q_tag_xyzw"].size(), 4U);
  EXPECT_EQ(known["pose"]["sigma_t_m"].size(), 3U);
  for (const auto& sigma : known["pose"]["sigma_t_m"]) EXPECT_GT(sigma.get<double>(), 0);
  EXPECT_TRUE(known.contains("other_pose"));
  EXPECT_FALSE(known.contains("pose_error"));
  const auto unknown = to_json(pose_fields(poses_of(detections, {pose_camera(), {}})[0]));
  EXPECT_FALSE(unknown.contains("pose"));
  EXPECT_FALSE(unknown["pose_error"]["message"].get<std::string>().empty());
}

using ::testing::HasSubstr;

class Described : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(said_.file) << to_camera_info_yaml({.name = "cam", .camera = camera_});
  }
  [[nodiscard]] std::string refusal() const {
    const auto read = read_camera(said_);
    return read ? "" : to_string(read.error());
  }

  CameraModel camera_ =
      CameraModel::make(PinholeRadtan{.fx = 500, .fy = 510, .cx = 320, .cy = 250}, 640, 480).value();
  std::filesystem::path folder_ = testing::fresh_folder("jobs_camera_description");
  CameraDescription said_{.file = (folder_ / "camera.yaml").string()};
};

TEST_F(Described, MatchesTheFile) {
  const auto read = read_camera(said_);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera, camera_);
  EXPECT_EQ(read->intrinsics_sigma.size(), 0);
  EXPECT_EQ(read->readout_s, 0);
  said_.readout_ms = -12;
  EXPECT_DOUBLE_EQ(read_camera(said_)->readout_s, -0.012);
}

TEST_F(Described, PosesRequireCameraAndTagSize) {
  const auto poses = described_poses(said_, {"0.16"});
  ASSERT_TRUE(poses && *poses);
  EXPECT_EQ((*poses)->camera, camera_);
  EXPECT_EQ((*poses)->sizes.default_size_m, 0.16);
  EXPECT_FALSE(described_poses({}, {}).value()) << "no pose requested";
  EXPECT_THAT(to_string(described_poses(said_, {}).error()), HasSubstr("(tag_size_m): poses require both"));
  EXPECT_THAT(to_string(described_poses({}, {"0.16"}).error()), HasSubstr("(camera): poses require both"));
  EXPECT_THAT(to_string(described_poses({.name = "left"}, {"0.16"}).error()), HasSubstr("(camera_name)"));
}

TEST_F(Described, IsScaledToTheGivenImageSize) {
  said_.size = "1280x960";
  const auto read = read_camera(said_);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera.width_px(), 1280);
  EXPECT_TRUE(intrinsics_of(read->camera).isApprox(2 * intrinsics_of(camera_)));
}

TEST_F(Described, StandardDeviationsAreScaledToo) {
  Calibration ours;
  ours.camera = camera_;
  ours.values = {{"fx_px", {.value = 500, .sigma = 2}},
                 {"fy_px", {.value = 510, .sigma = 2}},
                 {"cx_px", {.value = 320, .sigma = 3}},
                 {"cy_px", {.value = 250, .sigma = 3}}};
  said_.file = (folder_ / "calibration.yaml").string();
  ASSERT_TRUE(write_calibration(said_.file, ours));
  const auto as_it_is = read_camera(said_);
  said_.size = "320x240";
  const auto half = read_camera(said_);
  ASSERT_TRUE(as_it_is && half);
  ASSERT_EQ(as_it_is->intrinsics_sigma.size(), 4);
  EXPECT_GT(as_it_is->intrinsics_sigma.minCoeff(), 1);
  EXPECT_TRUE(half->intrinsics_sigma.isApprox(as_it_is->intrinsics_sigma / 2));
}

TEST_F(Described, PosesIncludeTheUncertaintyOfTheCalibration) {
  const auto exact = described_poses(said_, {"0.2"});
  ASSERT_TRUE(exact && *exact);
  EXPECT_EQ((*exact)->intrinsics_covariance.size(), 0) << "camera_info contains no standard deviations";
  EXPECT_THAT(calibration_note(**exact), HasSubstr("exact"));
  Calibration ours;
  ours.camera = camera_;
  ours.values = {{"fx_px", {.value = 500, .sigma = 2}},
                 {"fy_px", {.value = 510, .sigma = 2}},
                 {"cx_px", {.value = 320, .sigma = 3}},
                 {"cy_px", {.value = 250, .sigma = 3}}};
  ours.camera_correlations = Eigen::MatrixXd::Identity(4, 4);
  ours.camera_correlations(0, 1) = ours.camera_correlations(1, 0) = 0.9;
  said_.file = (folder_ / "calibration.yaml").string();
  ASSERT_TRUE(write_calibration(said_.file, ours));
  said_.size = "1280x960";
  const auto poses = described_poses(said_, {"0.2"});
  ASSERT_TRUE(poses && *poses);
  ASSERT_EQ((*poses)->intrinsics_covariance.rows(), 4);
  EXPECT_NEAR((*poses)->intrinsics_covariance(0, 1), 4 * 0.9 * 2 * 2, 1e-9);
  EXPECT_THAT(calibration_note(**poses), HasSubstr("include"));
  const PoseList found = poses_of(std::vector{seen(1)},
                                  {pose_camera(), {.default_size_m = 0.2}, (*poses)->intrinsics_covariance});
  ASSERT_TRUE(found[0]) << to_string(found[0].error());
  const auto json = to_json(pose_fields(found[0]));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_GT(json["pose"]["sigma_t_lens_m"][axis].get<double>(), 0);
    EXPECT_GT(json["pose"]["sigma_t_m"][axis], json["pose"]["sigma_t_lens_m"][axis]);
  }
}

TEST_F(Described, ADamagedCalibrationIsReported) {
  said_.file = (folder_ / "calibration.yaml").string();
  Calibration ours;
  ours.camera = camera_;
  std::ofstream(said_.file) << to_yaml(ours) << "camera_correlations: {fy_px: [2.0]}\n";
  EXPECT_THAT(refusal(), HasSubstr("camera_correlations"));
}

TEST_F(Described, ACalibrationContainsTheReadoutTime) {
  Calibration ours;
  ours.camera = camera_;
  ours.values = {{"fx_px", {.value = 500, .sigma = 2}},
                 {"fy_px", {.value = 510, .sigma = 2}},
                 {"readout_s", {.value = 0.02, .sigma = 0.001}}};
  said_.file = (folder_ / "calibration.yaml").string();
  ASSERT_TRUE(write_calibration(said_.file, ours));
  EXPECT_DOUBLE_EQ(read_camera(said_)->readout_s, 0.02);
  said_.readout_ms = 5;
  EXPECT_DOUBLE_EQ(read_camera(said_)->readout_s, 0.005) << "the caller's value overrides the file";
}

TEST_F(Described, AnInvalidImageSizeIsReported) {
  for (const char* size : {"1280", "x", "1280x", "1280x-960", "1280x960px", "0x0", "axb", "99999999999x1"}) {
    said_.size = size;
    EXPECT_THAT(refusal(), HasSubstr("(camera_size)")) << size;
    EXPECT_THAT(refusal(), HasSubstr("1280x720")) << size;
  }
  said_.size = "1280x720";
  EXPECT_THAT(refusal(), HasSubstr("does not scale to 1280x720"));
  said_.size = "9999999x7499999";
  EXPECT_NE(refusal(), "");
}

TEST_F(Described, ImagesOfAnotherSizeAreRefusedWithAHint) {
  EXPECT_TRUE(check_image_size(camera_, 640, 480));
  const Status twice = check_image_size(camera_, 1280, 960);
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(to_string(twice.error()), HasSubstr("`camera_size=1280x960`"));
  const Status cropped = check_image_size(camera_, 1280, 720);
  ASSERT_FALSE(cropped);
  EXPECT_THAT(to_string(cropped.error()), ::testing::Not(HasSubstr("camera_size")));
}

}  // namespace
}  // namespace waymark
