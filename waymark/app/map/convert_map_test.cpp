// Maps in other forms, and what is left out of them.
#include "waymark/app/map/convert_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/map/map_transforms.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2_convert.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

/// The tags of circuit24, with observations.
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

TEST_F(ConvertMap, EveryFormComesBackAsTheSamePlaces) {
  for (std::size_t form = 0; form < map_form_names().size(); ++form) {
    const std::string name = "map." + map_form_names()[form] + (form == 0 ? ".yaml" : ".txt");
    ConvertMapJob there = job(name, static_cast<MapForm>(form));
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

TEST_F(ConvertMap, OursKeepsWhatItSaysOfItself) {
  ASSERT_TRUE(convert_map(job("copy.yaml"), {}));
  const MapFile copy = read_map(folder_ / "copy.yaml").value();
  EXPECT_EQ(copy.provenance, circuit_map().provenance);
  EXPECT_EQ(copy.observations, circuit_map().observations);
  EXPECT_EQ(copy.anchor, circuit_map().anchor);
}

TEST_F(ConvertMap, TagsThatAreTakenOutAreGoneWithTheirObservations) {
  ConvertMapJob without = job("without.yaml");
  const TagId anchor = circuit_map().anchor;
  without.remove = {to_string(anchor)};
  ASSERT_TRUE(convert_map(without, {}));
  const MapFile map = read_map(without.output).value();
  EXPECT_EQ(map.tags.tags.size(), 23U);
  EXPECT_FALSE(map.observations.contains(anchor));
  EXPECT_NE(map.anchor, anchor) << "another tag is the anchor then";
  EXPECT_NE(map.tags.find(map.anchor), nullptr);
}

TEST_F(ConvertMap, MistakesAreToldBeforeAnythingIsWritten) {
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
  EXPECT_EQ(error(bad).place.key, "--remove");
  EXPECT_EQ(error(job("map.yaml")).code, ErrorCode::Unwritable);
  EXPECT_THAT(error(job("x.mcap")).hint, HasSubstr("--to tf"));
  bad = job("x.yaml");
  bad.input = "/nowhere/map.yaml";
  EXPECT_EQ(error(bad).place.source, "/nowhere/map.yaml");
}

TEST_F(ConvertMap, ACancelledJobWritesNothing) {
  EXPECT_FALSE(convert_map(job("copy.yaml"), test::cancelled_after(0)));
  EXPECT_FALSE(fs::exists(folder_ / "copy.yaml"));
}

TEST_F(ConvertMap, TransformsOfARecordingAreAMap) {
  const fs::path file = folder_ / "tags.mcap";
  ASSERT_TRUE(write_map_transforms(file, circuit_map()));
  EXPECT_TRUE(is_ros_recording(file));
  EXPECT_FALSE(is_ros_recording(folder_ / "map.yaml"));
  EXPECT_FALSE(is_ros_recording(folder_));
  const auto read = read_map_transforms(file, 0.16);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_LT(farthest(read->map.tags, circuit_map().tags), 1e-9);
  EXPECT_FALSE(write_map_transforms(file, circuit_map())) << "a recording is not written over";
}

TEST_F(ConvertMap, OfEachTagTheLastTransformFromTheMapCounts) {
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
