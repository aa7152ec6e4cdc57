// What a user says of the camera and the place of a video, in words.
#include "waymark/app/video/map_video_description.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

class VideoDescription : public ::testing::Test {
 protected:
  void SetUp() override {
    const CameraModel camera =
        CameraModel::make(PinholeRadtan{.fx = 520, .fy = 521, .cx = 318, .cy = 243}, 640, 480).value();
    ASSERT_TRUE(
        write_text_file(folder_ / "camera.yaml", to_camera_info_yaml({.name = "cam", .camera = camera})));
    said_.camera.file = (folder_ / "camera.yaml").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string refused() const {
    const auto job = described_map_video(said_, 0.165);
    return job ? "" : to_string(job.error());
  }

  std::filesystem::path folder_ = testing::fresh_folder("video-description");
  MapVideoDescription said_{};
};

TEST_F(VideoDescription, NamesTagsDistancesAndPlanes) {
  said_.anchor = "3,7";
  said_.distances = {"3,7,2.41", "tag36h11:3,9,1.5,0.002"};
  said_.upright = {"3", "7,9"};
  said_.planes = {"3,4,7", "9,10"};
  said_.camera.readout_ms = 15;
  said_.tag_size_sigma_m = 0.00033;
  const auto job = described_map_video(said_, 0.165);
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_EQ(job->anchors.size(), 2U);
  ASSERT_EQ(job->distances.size(), 2U);
  EXPECT_DOUBLE_EQ(job->distances[0].measured_m, 2.41);
  EXPECT_DOUBLE_EQ(job->distances[0].sigma_m, 0.005);
  EXPECT_DOUBLE_EQ(job->distances[1].sigma_m, 0.002);
  EXPECT_EQ(job->upright.size(), 3U);
  ASSERT_EQ(job->planes.size(), 2U);
  EXPECT_EQ(job->planes[0].size(), 3U);
  EXPECT_DOUBLE_EQ(job->readout_s, 0.015);
  EXPECT_DOUBLE_EQ(job->size_sigma, 0.002);
  EXPECT_EQ(job->intrinsics_sigma.size(), 0) << "camera_info has no standard deviations";
}

TEST_F(VideoDescription, WhatIsNoDistanceIsRefused) {
  for (const char* words : {"", "3,7", "3,7,", "3,7,far", "3,7,-1", "3,7,0", "3,3,1", "3,7,1,0", "3,7,nan",
                            "3,7,inf", "3,7,2.4m", "3,7,1,0.01,5", "wall,7,1"}) {
    said_.distances = {words};
    EXPECT_THAT(refused(), HasSubstr("no distance between two tags")) << words;
  }
}

TEST_F(VideoDescription, AWrongTagIsSaidOfItsFlag) {
  said_.floor = {"3,wall"};
  EXPECT_THAT(refused(), HasSubstr("--floor"));
  said_.floor = {};
  said_.planes = {"3,4", "wall"};
  EXPECT_THAT(refused(), HasSubstr("--plane"));
}

TEST_F(VideoDescription, ATagLiesOnTheFloorOrHangsOnAWall) {
  said_.floor = {"3,4"};
  said_.upright = {"7", "4"};
  EXPECT_THAT(refused(),
              ::testing::AllOf(HasSubstr("--upright"), HasSubstr("tag36h11:4"), HasSubstr("--floor")));
  said_.upright = {"7"};
  EXPECT_EQ(refused(), "");
}

TEST_F(VideoDescription, TheFieldIsAsLargeAsThePriorSays) {
  const std::string layout = (folder_ / "field.json").string();
  std::ofstream(layout) << R"({"tags":[{"ID":7,"pose":{"translation":{"x":4,"y":1,"z":1},
    "rotation":{"quaternion":{"W":0,"X":0,"Y":0,"Z":1}}}}],"field":{"length":16.5,"width":8.2}})";
  said_.prior = layout;
  const auto job = described_map_video(said_, 0.16);
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_EQ(job->field, (FieldSize{16.5, 8.2}));
}

TEST_F(VideoDescription, ACalibrationTellsItsShutterAndItsDoubt) {
  Calibration ours;
  ours.camera =
      CameraModel::make(PinholeRadtan{.fx = 520, .fy = 521, .cx = 318, .cy = 243}, 640, 480).value();
  ours.values = {{"fx_px", {.value = 520, .sigma = 2}},
                 {"fy_px", {.value = 521, .sigma = 2}},
                 {"readout_s", {.value = 0.02, .sigma = 0.001}}};
  ASSERT_TRUE(write_calibration(folder_ / "calibration.yaml", ours));
  said_.camera.file = (folder_ / "calibration.yaml").string();
  auto job = described_map_video(said_, 0.165);
  ASSERT_TRUE(job) << to_string(job.error());
  EXPECT_DOUBLE_EQ(job->readout_s, 0.02);
  ASSERT_GT(job->intrinsics_sigma.size(), 0);
  EXPECT_DOUBLE_EQ(job->intrinsics_sigma[0], 2);
  said_.camera.readout_ms = 5;
  job = described_map_video(said_, 0.165);
  ASSERT_TRUE(job);
  EXPECT_DOUBLE_EQ(job->readout_s, 0.005) << "what is said counts more";
}

}  // namespace
}  // namespace waymark
