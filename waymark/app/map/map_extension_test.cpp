// Extending a map with a lap: frozen, removed and unobserved tags, routes, and warnings.
#include "waymark/app/map/map_extension.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

MapFile true_map() {
  MapFile map{.tags = test::circuit().tags,
              .anchor = test::circuit().anchor,
              .provenance = {{"recording", "old.mcap"}}};
  for (auto& [id, mapped] : map.tags.tags) map.observations[id] = 5;
  return map;
}

class MapExtension : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(write_map(old_ / "map.yaml", true_map())); }
  static const std::string& lap() {
    static const std::string file =
        test::record_lap(testing::fresh_folder("jobs_extension_lap") / "lap.mcap", 9, {.for_s = 12});
    return file;
  }
  [[nodiscard]] Status extend(std::set<TagId> freeze, std::set<TagId> remove, const std::string& route = {}) {
    job_.freeze = std::move(freeze);
    job_.remove = std::move(remove);
    job_.route_name = route;
    return read_extended_map(old_, job_);
  }
  fs::path old_ = testing::fresh_folder("jobs_extension");
  MapJob job_{.lap = lap(), .folder = testing::fresh_folder("jobs_extended") / "map"};
};

std::string refused_field_of_lap(const MapJob& job) {
  const Status sound = check(job);
  return sound ? std::string("none") : sound.error().place.key;
}

TEST_F(MapExtension, RejectsFieldsThatRequireAMap) {
  EXPECT_EQ(refused_field_of_lap({}), "none");
  EXPECT_EQ(refused_field_of_lap({.route_name = "kitchen"}), "route_name");
  EXPECT_EQ(refused_field_of_lap({.freeze = {tag(1)}}), "freeze");
  EXPECT_EQ(refused_field_of_lap({.remove = {tag(1)}}), "remove");
  EXPECT_EQ(refused_field_of_lap({.map_sigma_m = 0.1}), "map_sigma");
  const auto made = map_recording({.lap = "/nowhere", .freeze = {tag(1)}}, {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().place.key, "freeze") << "checked before any file is read";
}

TEST_F(MapExtension, RejectsFieldsThatContradictTheMap) {
  ASSERT_TRUE(extend({tag(3)}, {tag(4)}, "kitchen"));
  job_.map_sigma_m = 0.1;
  EXPECT_EQ(refused_field_of_lap(job_), "none");
  MapJob job = job_;
  job.remove.insert(tag(3));
  EXPECT_EQ(refused_field_of_lap(job), "remove");
  job = job_;
  job.route_name = "a b";
  EXPECT_EQ(refused_field_of_lap(job), "route_name");
  job = job_;
  job.overrides.anchor = "3";
  EXPECT_EQ(refused_field_of_lap(job), "anchor");
  job = job_;
  job.overrides.map_T_anchor = SE3();
  EXPECT_EQ(refused_field_of_lap(job), "anchor_pose");
}

TEST_F(MapExtension, ReadsTheMapFromItsFileOrFolder) {
  MapJob job;
  ASSERT_TRUE(read_extended_map(old_ / "map.yaml", job));
  EXPECT_EQ(job.extended_folder, old_);
  ASSERT_TRUE(read_extended_map(old_, job));
  EXPECT_EQ(job.extended_folder, old_);
  EXPECT_EQ(job.extend->anchor, test::circuit().anchor);
  EXPECT_FALSE(read_extended_map("/nowhere", job));
}

TEST_F(MapExtension, KeepsFrozenAndUnobservedTags) {
  ASSERT_TRUE(extend({test::circuit().anchor}, {}));
  const TagId some = test::circuit().tags.tags.begin()->first;
  const auto report = map_recording(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(report->extends);
  const MapFile map = read_map(job_.folder / "map.yaml").value();
  EXPECT_EQ(map.tags.tags.size(), 24U) << "a short lap observes only some of them";
  const TagId anchor = test::circuit().anchor;
  EXPECT_LT(
      (map.tags.find(anchor)->map_T_tag.inverse() * true_map().tags.find(anchor)->map_T_tag).log().norm(),
      1e-9);
  EXPECT_EQ(map.provenance.back(), (std::pair<std::string, std::string>{"extends", "old.mcap"}));
  const std::size_t older = report->lap.observations.size();
  EXPECT_LE(older, map.observations.size()) << "observations from the extended map are included";
  EXPECT_GT(map.observations.at(some), 4);
}

TEST_F(MapExtension, RemovesTagsFromMapAndLap) {
  const std::vector<TagFrame> frames = read_lap_file(lap())->frames;
  const auto frame = std::ranges::find_if(frames, [](const TagFrame& f) { return !f.detections.empty(); });
  ASSERT_NE(frame, frames.end());
  const TagId seen = frame->detections.front().tag;
  ASSERT_TRUE(extend({}, {seen}));
  const auto report = map_recording(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->lap.map.find(seen), nullptr);
  EXPECT_EQ(report->lap.map.tags.size(), 23U);
}

TEST_F(MapExtension, AddsTheLapAsAFurtherRoute) {
  job_.folder = old_;
  ASSERT_TRUE(write_text_file(old_ / "route.yaml", "taught first"));
  ASSERT_TRUE(extend({}, {}, "kitchen"));
  const auto report = map_recording(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(test::file_text(old_ / "route.yaml"), "taught first");
  EXPECT_TRUE(read_route(old_ / "route-kitchen.yaml"));
  EXPECT_TRUE(fs::exists(old_ / "summary-kitchen.json"));
  EXPECT_THAT(report->renamed_files, Contains("map.yaml"));
}

TEST_F(MapExtension, RejectsMapsOfOtherPlacesAndUnknownTags) {
  MapFile other{.anchor = tag(500)};
  other.tags.tags[tag(500)] = {.map_T_tag = SE3(), .size_m = 0.16};
  ASSERT_TRUE(write_map(old_ / "map.yaml", other));
  ASSERT_TRUE(extend({}, {}));
  const auto nothing = map_recording(job_, {});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::NotFound);
  EXPECT_FALSE(fs::exists(job_.folder)) << "no files are left behind";
  for (const char* field : {"freeze", "remove"}) {
    MapJob job = job_;
    (std::string(field) == "freeze" ? job.freeze : job.remove).insert(tag(3));
    const auto unknown = map_recording(job, {});
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().place.key, field);
  }
}

TEST_F(MapExtension, WarnsAboutARepeatedRecordingAndAnotherTagSize) {
  MapFile again = true_map();
  again.provenance = {{"recording", fs::path(lap()).filename().string()}};
  ASSERT_TRUE(write_map(old_ / "map.yaml", again));
  ASSERT_TRUE(extend({}, {}));
  job_.overrides.tag_size_m = 0.3;
  const auto report = map_recording(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->warnings, Contains(HasSubstr(again.provenance.front().second)));
  EXPECT_THAT(report->warnings, Contains(HasSubstr("`tag_size_m=0.3`")));
}

TEST_F(MapExtension, RecognisesARecordingByItsContent) {
  ASSERT_TRUE(map_recording({.lap = lap(), .folder = old_}, {}));
  const fs::path renamed = job_.folder.parent_path() / "renamed.mcap";
  fs::copy_file(lap(), renamed);
  ASSERT_TRUE(extend({}, {}));
  job_.lap = renamed.string();
  const auto repeated = map_recording(job_, {});
  ASSERT_TRUE(repeated) << to_string(repeated.error());
  EXPECT_THAT(repeated->warnings, Contains(HasSubstr("this recording, under the name lap.mcap")));
  const fs::path same_name = testing::fresh_folder("jobs_extension_other") / "lap.mcap";
  job_.lap = test::record_lap(same_name, 10, {.for_s = 12});
  const auto another = map_recording(job_, {});
  ASSERT_TRUE(another) << to_string(another.error());
  EXPECT_THAT(another->warnings, ::testing::Not(Contains(HasSubstr("already contains"))));
  const MapFile map = read_map(job_.folder / "map.yaml").value();
  const auto has = [&](const char* key) {
    return std::ranges::count(map.provenance, key, &std::pair<std::string, std::string>::first);
  };
  EXPECT_EQ(has("content"), 1);
  EXPECT_EQ(has("content_2"), 1);
}

TEST_F(MapExtension, ReportsChangesSinceAnOlderMap) {
  MapFile moved = true_map();
  const auto seen = map_recording({.lap = lap(), .folder = job_.folder}, {})->lap.map;
  ASSERT_GE(seen.tags.size(), 4U);
  const TagId first = seen.tags.begin()->first;
  moved.tags.tags.at(first).map_T_tag = SE3(SO3(), {0, 0, 0.5}) * moved.tags.tags.at(first).map_T_tag;
  ASSERT_TRUE(write_map(old_ / "map.yaml", moved));
  job_.prior = read_landmarks(old_).value();
  const auto report = map_recording(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->prior_agreeing);
  EXPECT_GE(*report->prior_agreeing, 3);
  EXPECT_LT(report->prior_rms_m, 0.1);
  EXPECT_THAT(report->warnings, Contains(HasSubstr(to_string(first))));
  EXPECT_EQ(to_json(fields(*report))["tags"], seen.tags.size());
}

}  // namespace
}  // namespace waymark
