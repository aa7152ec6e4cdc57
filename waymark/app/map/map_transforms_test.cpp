// Maps that stand as transforms in a recording: written, read again, and what is in the way.
#include "waymark/app/map/map_transforms.hpp"

#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

MapFile map_of_three() {
  MapFile map{.anchor = {FamilyId::Tag36h11, 4}};
  for (int k = 0; k < 3; ++k) {
    const SE3 map_T_tag(SO3::exp({0.1 * k, -0.2, std::numbers::pi / (k + 2)}), {1.5 * k, -0.25, 0.3});
    map.tags.tags[{FamilyId::Tag36h11, 4 + k}] = {.map_T_tag = map_T_tag, .size_m = 0.16};
  }
  return map;
}

ros2::TransformStamped seen_from(const std::string& parent, const std::string& tag, double x_m) {
  return ros2::to_ros_transform(SensorTime{}, parent, tag, SE3(SO3(), {x_m, 0, 1}));
}

class MapTransforms : public ::testing::Test {
 protected:
  void record(const std::vector<ros2::TransformStamped>& transforms) {
    fs::remove(file_);
    auto sink = create_file(file_);
    ASSERT_TRUE(sink);
    auto recorder = SampleRecorder::open(std::move(*sink));
    ASSERT_TRUE(recorder);
    for (const ros2::TransformStamped& transform : transforms) {
      ros2::TFMessage message;
      message.transforms.push_back(transform);
      ASSERT_TRUE(recorder->add_message(topics::kTfStatic, SensorTime{}, message));
    }
    ASSERT_TRUE(recorder->close());
  }
  fs::path file_ = testing::fresh_folder("jobs_map_transforms") / "tags.mcap";
};

TEST_F(MapTransforms, WhatIsWrittenIsRead) {
  const MapFile map = map_of_three();
  ASSERT_TRUE(write_map_transforms(file_, map));
  EXPECT_TRUE(is_ros_recording(file_));
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->form, MapForm::Transforms);
  EXPECT_THAT(read->warnings, Not(Contains(HasSubstr("passed over"))));
  ASSERT_EQ(read->map.tags.tags.size(), map.tags.tags.size());
  for (const auto& [tag, mapped] : map.tags.tags) {
    const MappedTag* again = read->map.tags.find(tag);
    ASSERT_NE(again, nullptr) << to_string(tag);
    EXPECT_LT((again->map_T_tag.inverse() * mapped.map_T_tag).log().norm(), 1e-9) << to_string(tag);
    EXPECT_EQ(again->size_m, 0.16);
  }
}

TEST_F(MapTransforms, SizesHaveToBeGiven) {
  ASSERT_TRUE(write_map_transforms(file_, map_of_three()));
  const auto read = read_map_transforms(file_, std::nullopt);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().place.source, file_.string());
  EXPECT_THAT(to_string(read.error()), HasSubstr("size"));
}

TEST_F(MapTransforms, OfEachTagTheLastCounts) {
  record({seen_from("map", "tag36h11:1", 1), seen_from("map", "tag36h11:2", 2),
          seen_from("/map", "tag36h11:1", 3)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->map.tags.tags.size(), 2U);
  EXPECT_EQ(read->map.tags.find({FamilyId::Tag36h11, 1})->map_T_tag.translation().x(), 3);
  EXPECT_EQ(read->map.tags.find({FamilyId::Tag36h11, 2})->map_T_tag.translation().x(), 2);
}

TEST_F(MapTransforms, WhatOtherFramesSeeIsNamed) {
  record({seen_from("map", "tag36h11:1", 1), seen_from("camera", "tag36h11:7", 2),
          seen_from("map", "base_link", 0)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->map.tags.tags.size(), 1U) << "a frame that is no tag is none";
  EXPECT_THAT(read->warnings, Contains(HasSubstr("tag36h11:7 (from camera)")));
}

TEST_F(MapTransforms, ARecordingWithoutAMapSaysHowToMakeOne) {
  record({seen_from("camera", "tag36h11:7", 2)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::NotFound);
  EXPECT_THAT(read.error().hint, HasSubstr("waymark map"));
  record({});
  EXPECT_EQ(read_map_transforms(file_, 0.16).error().code, ErrorCode::NotFound);
}

TEST_F(MapTransforms, OtherFilesAreNoRecordings) {
  EXPECT_FALSE(is_ros_recording(file_)) << "there is none yet";
  EXPECT_FALSE(is_ros_recording(file_.parent_path()));
  for (const char* text : {"", "\x89MCA", "tags:\n", "#ROSBA"}) {
    std::ofstream(file_, std::ios::binary) << text;
    EXPECT_FALSE(is_ros_recording(file_)) << text;
  }
  std::ofstream(file_, std::ios::binary) << "#ROSBAG V2.0\n";
  EXPECT_TRUE(is_ros_recording(file_));
  EXPECT_FALSE(read_map_transforms(file_, 0.16)) << "it ends behind its first line";
}

TEST_F(MapTransforms, AFolderThatIsNotThereIsAnError) {
  const Status status = write_map_transforms(file_.parent_path() / "no" / "tags.mcap", map_of_three());
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Unwritable);
}

}  // namespace
}  // namespace waymark
