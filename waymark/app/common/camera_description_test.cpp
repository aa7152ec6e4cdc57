// A camera as a user names it: file, name, size of its pictures, shutter.
#include "waymark/app/common/camera_description.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"

namespace waymark {
namespace {

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

TEST_F(Described, IsAsTheFileSays) {
  const auto read = read_camera(said_);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera, camera_);
  EXPECT_EQ(read->intrinsics_sigma.size(), 0);
  EXPECT_EQ(read->readout_s, 0);
  said_.readout_ms = -12;
  EXPECT_DOUBLE_EQ(read_camera(said_)->readout_s, -0.012);
}

TEST_F(Described, PosesNeedItAndTheSizeOfTheTags) {
  const auto poses = described_poses(said_, {"0.16"});
  ASSERT_TRUE(poses && *poses);
  EXPECT_EQ((*poses)->camera, camera_);
  EXPECT_EQ((*poses)->sizes.default_size_m, 0.16);
  EXPECT_FALSE(described_poses({}, {}).value()) << "no pose was asked for";
  EXPECT_THAT(to_string(described_poses(said_, {}).error()), HasSubstr("(--tag-size-m): poses need both"));
  EXPECT_THAT(to_string(described_poses({}, {"0.16"}).error()), HasSubstr("(--camera): poses need both"));
  EXPECT_THAT(to_string(described_poses({.name = "left"}, {"0.16"}).error()), HasSubstr("(--camera-name)"));
}

TEST_F(Described, IsScaledWhenAsked) {
  said_.size = "1280x960";
  const auto read = read_camera(said_);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera.width_px(), 1280);
  EXPECT_TRUE(intrinsics_of(read->camera).isApprox(2 * intrinsics_of(camera_)));
}

TEST_F(Described, ItsDeviationsAreScaledToo) {
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

TEST_F(Described, WhatIsNoSizeIsNamed) {
  for (const char* size : {"1280", "x", "1280x", "1280x-960", "1280x960px", "0x0", "axb", "99999999999x1"}) {
    said_.size = size;
    EXPECT_THAT(refusal(), HasSubstr("--camera-size")) << size;
    EXPECT_THAT(refusal(), HasSubstr("1280x720")) << size;
  }
  said_.size = "1280x720";
  EXPECT_THAT(refusal(), HasSubstr("does not scale to 1280x720"));
  said_.size = "9999999x7499999";
  EXPECT_NE(refusal(), "");
}

TEST_F(Described, PicturesOfAnotherSizeAreRefusedWithAWayOut) {
  EXPECT_TRUE(check_picture_size(camera_, 640, 480));
  const Status twice = check_picture_size(camera_, 1280, 960);
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(to_string(twice.error()), HasSubstr("--camera-size 1280x960"));
  const Status cropped = check_picture_size(camera_, 1280, 720);
  ASSERT_FALSE(cropped);
  EXPECT_THAT(to_string(cropped.error()), ::testing::Not(HasSubstr("--camera-size")));
}

}  // namespace
}  // namespace waymark
