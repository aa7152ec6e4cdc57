#include "waymark/app/convert/convert_log.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/convert/record_camera.hpp"
#include "waymark/app/convert/recording_info.hpp"
#include "waymark/app/evaluate/report_page.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string& lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_convert_lap") / "lap.mcap", 9, {.for_s = 4});
  return file;
}

class ConvertLog : public ::testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_ = testing::fresh_folder("jobs_convert");
};

TEST_F(ConvertLog, ATableHasOneLinePerSample) {
  const ConvertJob job{.inputs = {lap()}, .output = at("odometry.csv"), .kind = "odometry"};
  const auto report = convert_log(job, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->format, "csv");
  const std::string text = test::file_text(job.output);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(text, '\n')), report->exported.messages + 1);
  EXPECT_EQ(to_json(fields(*report))["messages"], report->exported.messages);
}

TEST(ConvertReport, OneInputIsAStringAndSeveralAreAList) {
  ConvertReport report{.inputs = {"a.csv"}, .output = "lap.mcap", .format = "mcap"};
  report.exported.messages = 2;
  report.exported.by_topic = {{"/odom", 2}};
  report.exported.problems = {
      {LogProblem::Kind::Trap, "csv.units", Error{ErrorCode::Unreadable, "millimetres"}}};
  const auto one = to_json(fields(report));
  EXPECT_EQ(one["input"], "a.csv");
  EXPECT_EQ(one["topics"]["/odom"], 2);
  EXPECT_EQ(one["problems"][0]["kind"], "trap");
  report.inputs.emplace_back("b.csv");
  EXPECT_EQ(to_json(fields(report))["input"].dump(), R"(["a.csv","b.csv"])");
}

TEST(RecordCameraReport, ContainsTheCountsOfImages) {
  RecordCameraReport report{.input = "v4l2:/dev/video0", .output = "desk.mcap"};
  report.end.images = 30;
  report.end.seconds = 2.5;
  report.end.counts.dropped = 1;
  EXPECT_EQ(
      to_json(fields(report)).dump(),
      R"({"input":"v4l2:/dev/video0","input_format":"camera","output":"desk.mcap",)"
      R"("output_format":"mcap","images":30,"tags":0,"unreliable_tags":0,"seconds":2.5,"dropped":1,"lost":0,"damaged":0})");
}

TEST_F(ConvertLog, FromAndToLimitTheInterval) {
  const auto info = look_at(lap(), false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  const auto all = convert_log({.inputs = {lap()}, .output = at("all.mcap")}, {});
  ASSERT_TRUE(all) << to_string(all.error());
  EXPECT_EQ(all->exported.messages, info->report.messages);
  const auto part = convert_log({.inputs = {lap()}, .output = at("part.mcap"), .from = "1", .to = "2"}, {});
  ASSERT_TRUE(part) << to_string(part.error());
  EXPECT_LT(part->exported.messages, all->exported.messages / 2);
  EXPECT_GT(part->exported.messages, all->exported.messages / 8);
}

TEST_F(ConvertLog, NothingIsOverwritten) {
  ASSERT_TRUE(convert_log({.inputs = {lap()}, .output = at("path.tum"), .topics = {"/odom"}}, {}));
  const std::string before = test::file_text(at("path.tum"));
  const auto again = convert_log({.inputs = {lap()}, .output = at("path.tum"), .topics = {"/odom"}}, {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(test::file_text(at("path.tum")), before);
}

TEST_F(ConvertLog, ACancelledJobLeavesNoFile) {
  const auto report = convert_log({.inputs = {lap()}, .output = at("out.mcap")}, test::cancelled_after(0));
  ASSERT_FALSE(report);
  EXPECT_EQ(test::names_in(folder_), std::vector<std::string>{});
}

TEST_F(ConvertLog, InvalidJobsAndUnusableFilesHaveDifferentCodes) {
  const auto code = [&](ConvertJob job) {
    if (job.inputs.empty()) job.inputs = {lap()};
    if (job.output.empty()) job.output = at("out.mcap");
    const auto report = convert_log(job, {});
    EXPECT_FALSE(report);
    EXPECT_EQ(test::names_in(folder_), std::vector<std::string>{});
    return report ? ErrorCode::LimitExceeded : report.error().code;
  };
  EXPECT_EQ(code({.output = at("out.xyz")}), ErrorCode::InvalidArgument);
  EXPECT_EQ(code({.from = "soon"}), ErrorCode::InvalidArgument);
  EXPECT_EQ(code({.from = "3", .to = "2"}), ErrorCode::InvalidArgument);
  EXPECT_EQ(code({.topics = {"/odomm"}}), ErrorCode::NotFound);
  EXPECT_EQ(code({.inputs = {"/nowhere/lap.mcap"}}), ErrorCode::NotFound);
  EXPECT_EQ(code({.inputs = {lap(), lap()}}), ErrorCode::Unreadable) << "two drives cannot be merged";
}

TEST(RecordingInfo, ListsContentsAndNextSteps) {
  const auto info = look_at(lap(), false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_NEAR(info->report.duration_s, 4, 0.3);
  EXPECT_TRUE(info->contents.contains("tags"));
  bool maps = false;
  for (const NextStep& step : next_steps(*info))
    maps = maps || step.command == "waymark map " + lap() + " -o map";
  EXPECT_TRUE(maps) << "the recording contains the anchor, the tag size and the camera, so no flag is needed";
  const auto quick = look_at(lap(), true, {});
  ASSERT_TRUE(quick);
  EXPECT_EQ(quick->report.messages, info->report.messages);
  EXPECT_FALSE(look_at("/nowhere/lap.mcap", false, {}));
}

TEST(ReportPage, ReplacesOnlyReports) {
  const fs::path folder = testing::fresh_folder("jobs_report");
  const fs::path page = folder / "report.html";
  const auto summary = write_report({lap()}, page, false, {});
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(test::file_text(page).size(), summary->bytes);
  EXPECT_GE(summary->sections, 1U);
  EXPECT_TRUE(write_report({lap()}, page, false, {}));
  ASSERT_TRUE(write_text_file(page, "another page"));
  EXPECT_FALSE(write_report({lap()}, page, false, {}));
  EXPECT_EQ(test::file_text(page), "another page");
  EXPECT_TRUE(write_report({lap()}, page, true, {}));
}

TEST(ReportPage, FiguresHaveUniqueNames) {
  const auto runs = read_runs({lap(), lap()}, {});
  ASSERT_TRUE(runs) << to_string(runs.error());
  const auto page = report_page(*runs, {});
  ASSERT_TRUE(page) << to_string(page.error());
  std::vector<std::string> names;
  for (const plot::PageFigure& figure : figures_of(*page)) names.push_back(figure.name);
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
  EXPECT_FALSE(read_runs({testing::fresh_folder("jobs_empty").string()}, {})) << "the folder is empty";
}

}  // namespace
}  // namespace waymark
