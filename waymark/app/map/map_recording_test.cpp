#include "waymark/app/map/map_recording.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/golden_page.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// Twelve seconds of a lap, which contain enough tags for a map.
const std::string& short_lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_short_lap") / "lap.mcap", 5, {.for_s = 12});
  return file;
}

std::string lines_of(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += sentence + "\n";
  return text;
}

class MapLap : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("jobs_map") / "map";
};

TEST_F(MapLap, SummaryMatchesFilesAndGroundTruth) {
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  const MapFile map = read_map(folder_ / "map.yaml").value();
  EXPECT_EQ(map.tags.tags.size(), report->lap.map.tags.size());
  EXPECT_GE(map.tags.tags.size(), 3U);
  EXPECT_EQ(map.anchor, test::circuit().anchor);
  EXPECT_NEAR(read_route(folder_ / "route.yaml").value().length_m, report->lap.route.length_m, 1e-3);
  // Compared with the world directly, without alignment.
  double squared = 0;
  for (const auto& [tag, mapped] : map.tags.tags)
    squared += (mapped.map_T_tag.translation() - test::circuit().tags.find(tag)->map_T_tag.translation())
                   .squaredNorm();
  const double rmse_m = std::sqrt(squared / static_cast<double>(map.tags.tags.size()));
  ASSERT_TRUE(report->tag_errors);
  EXPECT_NEAR(report->tag_errors->rmse_m, rmse_m, 1e-6);
  EXPECT_LT(rmse_m, 0.05);
  const auto json = nlohmann::ordered_json::parse(test::file_text(folder_ / "summary.json"));
  EXPECT_EQ(json["tags"], map.tags.tags.size());
  EXPECT_EQ(json.dump(), to_json(fields(*report)).dump());
  for (const std::string& file : report->files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST_F(MapLap, OdometryInTransformsGivesTheSameMap) {
  const fs::path lap = testing::fresh_folder("jobs_map_transforms") / "lap.mcap";
  const auto usual = map_recording({.lap = short_lap(), .folder = folder_}, {});
  test::record_lap(lap, 5, {.for_s = 12, .odometry_in_transforms = true});
  const auto report = map_recording({.lap = lap.string(), .folder = folder_}, {});
  ASSERT_TRUE(usual && report) << to_string(report.error());
  EXPECT_EQ(usual->odometry, "/odom");
  EXPECT_EQ(report->odometry, "/tf (odom to base_link)");
  ASSERT_TRUE(report->tag_errors);
  EXPECT_NEAR(report->tag_errors->rmse_m, usual->tag_errors->rmse_m, 1e-4);
  EXPECT_NEAR(report->lap.bundle->odometry_scales.distance, usual->lap.bundle->odometry_scales.distance,
              1e-3);
}

TEST_F(MapLap, GroundTruthOfAnotherClockDoesNotHideMissingOdometry) {
  const fs::path folder = testing::fresh_folder("jobs_map_truth_clock");
  const std::string usual = test::record_lap(folder / "usual.mcap", 5, {.for_s = 12, .odometry = false});
  const std::string other =
      test::record_lap(folder / "other.mcap", 5, {.for_s = 12, .odometry = false, .truth_ahead_s = 3600});
  const auto expected = map_recording({.lap = usual, .folder = folder_}, {});
  const auto report = map_recording({.lap = other, .folder = folder_}, {});
  ASSERT_TRUE(expected && report) << to_string(report.error());
  EXPECT_THAT(report->warnings, Contains(HasSubstr("3600 s")));
  EXPECT_THAT(report->warnings, IsSupersetOf(expected->warnings)) << "including that there is no odometry";
}

TEST_F(MapLap, OdometryOfAnotherClockIsNotUsed) {
  const fs::path folder = testing::fresh_folder("jobs_map_clocks");
  const std::string without = test::record_lap(folder / "without.mcap", 5, {.for_s = 12, .odometry = false});
  const std::string other =
      test::record_lap(folder / "other.mcap", 5, {.for_s = 12, .motion_ahead_s = 1'700'000'000});
  const auto tags_alone = map_recording({.lap = without, .folder = folder_}, {});
  const auto report = map_recording({.lap = other, .folder = folder_}, {});
  ASSERT_TRUE(tags_alone && report) << to_string(report.error());
  EXPECT_EQ(report->odometry, "");
  EXPECT_THAT(report->warnings, Contains(HasSubstr("1700000000 s")));
  EXPECT_THAT(report->warnings, Not(Contains(HasSubstr("contains no odometry")))) << "the cause is named";
  ASSERT_TRUE(report->tag_errors && tags_alone->tag_errors);
  EXPECT_NEAR(report->tag_errors->rmse_m, tags_alone->tag_errors->rmse_m, 1e-9);
  testing::expect_on_page("map", lines_of(tags_alone->warnings));
}

TEST_F(MapLap, TheClearanceOfTheRouteIsReported) {
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->nearest_tag);
  EXPECT_GT(report->nearest_tag->clearance_m, 0.3) << "as in the world";
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["route_clearance_m"], report->nearest_tag->clearance_m);
  EXPECT_FALSE(json.contains("route_sideways_deg"));
}

TEST_F(MapLap, BacksUpAnOlderMap) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "map.yaml") << "older";
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->renamed_files, Contains("map.yaml"));
  EXPECT_EQ(test::file_text(folder_ / "map.1.yaml"), "older");
}

TEST_F(MapLap, CancellingLeavesTheFolderUnchanged) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "map.yaml") << "older";
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, test::cancelled_after(3));
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("nothing was written"));
  EXPECT_EQ(test::names_in(folder_), std::vector<std::string>{"map.yaml"});
  EXPECT_EQ(test::file_text(folder_ / "map.yaml"), "older");
}

TEST_F(MapLap, ReportsProgress) {
  std::vector<std::string> steps;
  JobControl control;
  control.progress = [&](const JobProgress& now) { steps.push_back(now.text); };
  ASSERT_TRUE(map_recording({.lap = short_lap(), .folder = folder_}, control));
  EXPECT_THAT(steps, Contains(HasSubstr("cost")));
}

TEST_F(MapLap, RequiresFactsMissingInTheRecording) {
  const std::string file = test::record_lap(testing::fresh_folder("jobs_no_facts") / "lap.mcap", 6,
                                            {.for_s = 12, .anchor_and_size = false});
  const auto without = map_recording({.lap = file, .folder = folder_}, {});
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::NotFound);
  EXPECT_EQ(without.error().place.source, file);
  EXPECT_THAT(without.error().hint, HasSubstr("`tag_size_m`"));
  EXPECT_FALSE(fs::exists(folder_)) << "no files are left behind";
  MapJob job{.lap = file, .folder = folder_};
  job.overrides.tag_size_m = 0.16;
  EXPECT_FALSE(map_recording(job, {})) << "the anchor is unknown as well";
  job.overrides.anchor = to_string(test::circuit().anchor);
  const auto with = map_recording(job, {});
  ASSERT_TRUE(with) << to_string(with.error());
  EXPECT_FALSE(with->tag_errors) << "the map frame is not that of the ground truth";
}

TEST_F(MapLap, RejectsAnEmptyRecording) {
  const std::string file =
      test::record_lap(testing::fresh_folder("jobs_nothing") / "lap.mcap", 7, {.for_s = -1});
  const auto report = map_recording({.lap = file, .folder = folder_}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().place.source, file);
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(MapLap, ReportsAMissingFileAndAnInvalidFolder) {
  const auto missing = map_recording({.lap = "/nowhere/lap.mcap", .folder = folder_}, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.source, "/nowhere/lap.mcap");
  std::ofstream(folder_) << "a file";
  const auto unwritable = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_FALSE(unwritable);
  EXPECT_EQ(unwritable.error().code, ErrorCode::Unwritable);
}

constexpr TagId lap_tag(int number) { return {FamilyId::Tag36h11, number}; }

/// A lap recorded by a robot that reports tag poses but no corners.
RecordedLap lap_of_poses() {
  RecordedLap lap;
  lap.setup.base_T_cam = SE3(body_R_optical(), {0.1, 0, 0.2});
  for (int i = 0; i <= 120; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    const SE2 base(0.02 * i, 0.2 * std::sin(0.05 * i),
                   std::atan(0.5 * std::cos(0.05 * i)));  // tangent to the curve
    lap.odometry.push_back({stamp, SE2(base), 0.4, 0});
    TagPoseFrame frame{.stamp = stamp};
    for (int t = 0; t < 4; ++t) {
      const SE3 map_T_tag(body_R_optical(), {4, 0.6 * t - 1, 0.3});
      const SE3 cam_T_tag = (lift(base) * *lap.setup.base_T_cam).inverse() * map_T_tag;
      frame.tags.push_back({lap_tag(t), cam_T_tag});
    }
    lap.tag_poses.push_back(frame);
  }
  return lap;
}

TEST(MapPoses, MapFrameIsTheStartOfTheLap) {
  MapReport report;
  MapJob job{.lap = "lap.log"};
  job.overrides.tag_size_m = 0.16;
  const auto map = map_poses(lap_of_poses(), job, report);
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(report.method, "poses");
  EXPECT_EQ(map->provenance.front(), (std::pair<std::string, std::string>{"method", "poses"}));
  ASSERT_TRUE(report.poses);
  EXPECT_EQ(map->tags.tags.size(), 4U);
  EXPECT_TRUE(map->tags.find(map->anchor) != nullptr);
  EXPECT_NEAR((map->tags.find(lap_tag(0))->map_T_tag.translation() -
               map->tags.find(lap_tag(3))->map_T_tag.translation())
                  .norm(),
              1.8, 0.05)
      << "distances between tags must be correct";
  EXPECT_THAT(report.warnings, IsEmpty());
}

TEST(MapPoses, TagSizesAreThoseOfTheRecording) {
  MapReport report;
  RecordedLap lap = lap_of_poses();
  lap.setup.metadata[lap_facts::kMetadata][lap_facts::kTagSize] = "0.054";
  const auto map = map_poses(lap, {.lap = "lap.log"}, report);
  ASSERT_TRUE(map) << to_string(map.error());
  for (const auto& [id, mapped] : map->tags.tags) EXPECT_EQ(mapped.size_m, 0.054) << to_string(id);
  EXPECT_THAT(report.lap.warnings, Not(Contains(HasSubstr("tag size"))));
  MapJob job{.lap = "lap.log"};
  job.overrides.tag_size_m = 0.08;
  EXPECT_EQ(map_poses(lap, job, report)->tags.tags.begin()->second.size_m, 0.08)
      << "the given size overrides the recording";
}

TEST(MapPoses, RejectsFieldsThatRequireCorners) {
  MapReport report;
  MapJob job{.lap = "lap.log"};
  job.overrides.anchor = "3";
  const auto anchored = map_poses(lap_of_poses(), job, report);
  ASSERT_FALSE(anchored);
  EXPECT_EQ(anchored.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(anchored.error().hint, HasSubstr("`anchor`"));
}

TEST(MapPoses, WarnsAboutAnUnknownMounting) {
  MapReport report;
  MapJob job{.lap = "lap.log"};
  RecordedLap lap = lap_of_poses();
  lap.setup.base_T_cam.reset();
  (void)map_poses(lap, job, report);
  EXPECT_THAT(report.warnings, Contains(HasSubstr("camera mounting")));
}

}  // namespace
}  // namespace waymark
