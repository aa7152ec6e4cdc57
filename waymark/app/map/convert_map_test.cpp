// Maps are written to a recording as transforms, read back, and converted between formats. Tags are removed,
// and invalid input is rejected.
#include "waymark/app/map/convert_map.hpp"

#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"

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

ros2::TransformStamped transform_from(const std::string& parent, const std::string& tag, double x_m) {
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

TEST_F(MapTransforms, RoundTripKeepsTagPoses) {
  const MapFile map = map_of_three();
  ASSERT_TRUE(write_map_transforms(file_, map));
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->form, MapForm::Transforms);
  EXPECT_THAT(read->warnings, Not(Contains(HasSubstr("skipped"))));
  ASSERT_EQ(read->map.tags.tags.size(), map.tags.tags.size());
  for (const auto& [tag, mapped] : map.tags.tags) {
    const MappedTag* again = read->map.tags.find(tag);
    ASSERT_NE(again, nullptr) << to_string(tag);
    EXPECT_LT((again->map_T_tag.inverse() * mapped.map_T_tag).log().norm(), 1e-9) << to_string(tag);
    EXPECT_EQ(again->size_m, 0.16);
  }
}

TEST_F(MapTransforms, RequiresTheTagSize) {
  ASSERT_TRUE(write_map_transforms(file_, map_of_three()));
  const auto read = read_map_transforms(file_, std::nullopt);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().place.source, file_.string());
  EXPECT_THAT(to_string(read.error()), HasSubstr("size"));
}

TEST_F(MapTransforms, UsesTheLastTransformOfEachTag) {
  record({transform_from("map", "tag36h11:1", 1), transform_from("map", "tag36h11:2", 2),
          transform_from("/map", "tag36h11:1", 3)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->map.tags.tags.size(), 2U);
  EXPECT_EQ(read->map.tags.find({FamilyId::Tag36h11, 1})->map_T_tag.translation().x(), 3);
  EXPECT_EQ(read->map.tags.find({FamilyId::Tag36h11, 2})->map_T_tag.translation().x(), 2);
}

TEST_F(MapTransforms, ReportsTagsWithOtherParentFrames) {
  record({transform_from("map", "tag36h11:1", 1), transform_from("camera", "tag36h11:7", 2),
          transform_from("map", "base_link", 0)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->map.tags.tags.size(), 1U) << "base_link is not a tag";
  EXPECT_THAT(read->warnings, Contains(HasSubstr("tag36h11:7 (from camera)")));
}

TEST_F(MapTransforms, RejectsARecordingWithoutAMap) {
  record({transform_from("camera", "tag36h11:7", 2)});
  const auto read = read_map_transforms(file_, 0.16);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::NotFound);
  EXPECT_THAT(read.error().hint, HasSubstr("waymark map"));
  record({});
  EXPECT_EQ(read_map_transforms(file_, 0.16).error().code, ErrorCode::NotFound);
}

TEST_F(MapTransforms, RejectsABagTruncatedAfterItsFirstLine) {
  std::ofstream(file_, std::ios::binary) << "#ROSBAG V2.0\n";
  EXPECT_FALSE(read_map_transforms(file_, 0.16));
}

TEST_F(MapTransforms, RejectsAMissingFolder) {
  const Status status = write_map_transforms(file_.parent_path() / "no" / "tags.mcap", map_of_three());
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::Unwritable);
}

/// A map of the tags in circuit24, with observations.
MapFile circuit_map() {
  MapFile map{.tags = test::circuit().tags,
              .anchor = test::circuit().anchor,
              .provenance = {{"method", "bundle"}, {"recording", "lap.mcap"}}};
  for (const auto& [id, mapped] : map.tags.tags) map.observations[id] = 7;
  return map;
}

class ConvertMap : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(write_map(folder_ / "map.yaml", circuit_map())); }
  [[nodiscard]] ConvertMapJob job(const std::string& output, MapForm form = MapForm::Waymark) const {
    return {.input = (folder_ / "map.yaml").string(), .output = (folder_ / output).string(), .form = form};
  }
  static double farthest(const TagMap& a, const TagMap& b) {
    double worst = a.tags.size() == b.tags.size() ? 0 : 1e9;
    for (const auto& [id, tag] : a.tags) {
      const MappedTag* other = b.find(id);
      worst =
          std::max(worst, other == nullptr ? 1e9 : (tag.map_T_tag.inverse() * other->map_T_tag).log().norm());
    }
    return worst;
  }
  fs::path folder_ = testing::fresh_folder("jobs_convert_map");
};

TEST_F(ConvertMap, EveryFormatRoundTripsTagPoses) {
  for (std::size_t form = 0; form < map_form_names().size(); ++form) {
    const std::string name = "map." + map_form_names()[form] + (form == 0 ? ".yaml" : ".txt");
    const ConvertMapJob there = job(name, static_cast<MapForm>(form));
    const auto written = convert_map(there, {});
    ASSERT_TRUE(written) << map_form_names()[form] << ": " << to_string(written.error());
    const auto back = convert_map({.input = there.output,
                                   .output = (folder_ / ("back." + name + ".yaml")).string(),
                                   .tag_size_m = 0.16},
                                  {});
    ASSERT_TRUE(back) << map_form_names()[form] << ": " << to_string(back.error());
    EXPECT_LT(farthest(back->map.tags, circuit_map().tags), 1e-5) << map_form_names()[form];
  }
}

TEST_F(ConvertMap, OwnFormatKeepsProvenanceObservationsAndAnchor) {
  ASSERT_TRUE(convert_map(job("copy.yaml"), {}));
  const MapFile copy = read_map(folder_ / "copy.yaml").value();
  EXPECT_EQ(copy.provenance, circuit_map().provenance);
  EXPECT_EQ(copy.observations, circuit_map().observations);
  EXPECT_EQ(copy.anchor, circuit_map().anchor);
}

TEST_F(ConvertMap, ReportContainsFileFormatsAndTags) {
  const auto done = convert_map(job("copy.yaml"), {});
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(to_json(fields(*done)).dump(),
            R"({"output":")" + (folder_ / "copy.yaml").string() +
                R"(","from":"waymark","to":"waymark","tags":24,"warnings":[]})");
}

TEST_F(ConvertMap, RemovesTagsWithTheirObservations) {
  ConvertMapJob without = job("without.yaml");
  const TagId anchor = circuit_map().anchor;
  without.remove = {to_string(anchor)};
  ASSERT_TRUE(convert_map(without, {}));
  const MapFile map = read_map(without.output).value();
  EXPECT_EQ(map.tags.tags.size(), 23U);
  EXPECT_FALSE(map.observations.contains(anchor));
  EXPECT_NE(map.anchor, anchor) << "another tag becomes the anchor";
  EXPECT_NE(map.tags.find(map.anchor), nullptr);
}

TEST_F(ConvertMap, RejectsInvalidJobsBeforeWriting) {
  const auto error = [&](ConvertMapJob wanted) {
    const auto before = test::names_in(folder_);
    const auto done = convert_map(wanted, {});
    EXPECT_FALSE(done);
    EXPECT_EQ(test::names_in(folder_), before);
    return done ? Error{} : done.error();
  };
  ConvertMapJob bad = job("x.yaml");
  bad.remove = {"nonsense"};
  EXPECT_FALSE(error(bad).message.empty());
  bad.remove = {"400"};
  EXPECT_EQ(error(bad).place.key, "remove");
  EXPECT_EQ(error(job("map.yaml")).code, ErrorCode::Unwritable);
  EXPECT_THAT(error(job("x.mcap")).hint, HasSubstr("`to=tf`"));
  bad = job("x.yaml");
  bad.input = "/nowhere/map.yaml";
  EXPECT_EQ(error(bad).place.source, "/nowhere/map.yaml");
}

TEST_F(ConvertMap, ACancelledJobWritesNothing) {
  EXPECT_FALSE(convert_map(job("copy.yaml"), test::cancelled_after(0)));
  EXPECT_FALSE(fs::exists(folder_ / "copy.yaml"));
}

TEST_F(ConvertMap, ReadsTheTransformsOfARecording) {
  const fs::path file = folder_ / "tags.mcap";
  ASSERT_TRUE(write_map_transforms(file, circuit_map()));
  const auto read = read_map_transforms(file, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_LT(farthest(read->map.tags, circuit_map().tags), 1e-9);
  EXPECT_FALSE(write_map_transforms(file, circuit_map())) << "recordings are never overwritten";
}

TEST_F(ConvertMap, UsesTheLastTransformOfEachTagFromTheMapFrame) {
  const fs::path file = folder_ / "moved.mcap";
  auto recorder = SampleRecorder::open(std::move(*create_file(file)));
  ASSERT_TRUE(recorder);
  const auto add = [&](int second, const char* parent, const char* child, double x_m) {
    const SensorTime stamp{std::chrono::seconds(second)};
    ros2::TFMessage message;
    message.transforms.push_back(ros2::to_ros_transform(stamp, parent, child, lift(SE2(x_m, 0, 0))));
    EXPECT_TRUE(recorder->add_message(topics::kTf, stamp, message));
  };
  add(1, "map", "tag36h11:1", 1);
  add(2, "map", "tag36h11:1", 2);
  add(3, "camera", "tag36h11:5", 3);
  add(4, "map", "base_link", 4);
  ASSERT_TRUE(recorder->close());
  const auto read = read_map_transforms(file, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->map.tags.tags.size(), 1U);
  EXPECT_NEAR(read->map.tags.tags.begin()->second.map_T_tag.translation().x(), 2, 1e-12);
  EXPECT_THAT(read->warnings, Contains(HasSubstr("tag36h11:5 (from camera)")));
  const std::string lap = test::record_lap(folder_ / "lap.mcap", 61, {.for_s = 1});
  const auto none = read_map_transforms(lap, 0.16);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().hint, HasSubstr("waymark map"));
}

}  // namespace
}  // namespace waymark
