#include "waymark/app/map/map_recording.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Twelve seconds of a lap: some tags, enough for a map.
const std::string& short_lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_short_lap") / "lap.mcap", 5, {.for_s = 12});
  return file;
}

class MapLap : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("jobs_map") / "map";
};

TEST_F(MapLap, TheSummaryIsThatOfTheFilesAndOfTheTruth) {
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  const MapFile map = read_map(folder_ / "map.yaml").value();
  EXPECT_EQ(map.tags.tags.size(), report->lap.map.tags.size());
  EXPECT_GE(map.tags.tags.size(), 3U);
  EXPECT_EQ(map.anchor, test::circuit().anchor);
  EXPECT_NEAR(read_route(folder_ / "route.yaml").value().length_m, report->lap.route.length_m, 1e-3);
  // Judged here by the world itself: nothing is aligned.
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
  EXPECT_EQ(json.dump(), to_json(*report).dump());
  for (const std::string& file : report->files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST_F(MapLap, AnOlderMapIsSetAside) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "map.yaml") << "older";
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->set_aside, Contains("map.yaml"));
  EXPECT_EQ(test::file_text(folder_ / "map.1.yaml"), "older");
}

TEST_F(MapLap, ACancelledJobLeavesTheFolderAsItWas) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "map.yaml") << "older";
  const auto report = map_recording({.lap = short_lap(), .folder = folder_}, test::cancelled_after(3));
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("nothing was written"));
  EXPECT_EQ(test::names_in(folder_), std::vector<std::string>{"map.yaml"});
  EXPECT_EQ(test::file_text(folder_ / "map.yaml"), "older");
}

TEST_F(MapLap, ProgressIsTold) {
  std::vector<std::string> words;
  JobControl control;
  control.progress = [&](const JobProgress& now) { words.push_back(now.words); };
  ASSERT_TRUE(map_recording({.lap = short_lap(), .folder = folder_}, control));
  EXPECT_THAT(words, Contains(HasSubstr("cost")));
}

TEST_F(MapLap, WhatTheRecordingDoesNotSayHasToBeGiven) {
  const std::string file = test::record_lap(testing::fresh_folder("jobs_no_facts") / "lap.mcap", 6,
                                            {.for_s = 12, .knows_robot = false});
  const auto without = map_recording({.lap = file, .folder = folder_}, {});
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::NotFound);
  EXPECT_EQ(without.error().place.source, file);
  EXPECT_THAT(without.error().hint, HasSubstr("--tag-size-m"));
  EXPECT_FALSE(fs::exists(folder_)) << "nothing is left of it";
  MapJob job{.lap = file, .folder = folder_};
  job.overrides.tag_size_m = 0.16;
  EXPECT_FALSE(map_recording(job, {})) << "the anchor is not known either";
  job.overrides.anchor = to_string(test::circuit().anchor);
  const auto with = map_recording(job, {});
  ASSERT_TRUE(with) << to_string(with.error());
  EXPECT_FALSE(with->tag_errors) << "the map does not stand where the truth does";
}

TEST_F(MapLap, ARecordingOfNothingMakesNoMap) {
  const std::string file =
      test::record_lap(testing::fresh_folder("jobs_nothing") / "lap.mcap", 7, {.for_s = -1});
  const auto report = map_recording({.lap = file, .folder = folder_}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().place.source, file);
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(MapLap, NoFileAndNoFolderAreErrorsWithTheirPlace) {
  const auto missing = map_recording({.lap = "/nowhere/lap.mcap", .folder = folder_}, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.source, "/nowhere/lap.mcap");
  std::ofstream(folder_) << "a file";
  const auto unwritable = map_recording({.lap = short_lap(), .folder = folder_}, {});
  ASSERT_FALSE(unwritable);
  EXPECT_EQ(unwritable.error().code, ErrorCode::Unwritable);
}

}  // namespace
}  // namespace waymark
