// Summaries of intact and damaged recordings, recovery of damaged ones, and the commands suggested by
// `waymark info`.
#include "waymark/app/convert/recording_info.hpp"

#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/convert/recover_log.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string& short_lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_info_lap") / "my lap.mcap", 15, {.for_s = 4});
  return file;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Writes a file that contains only the given fraction of the lap's bytes.
std::string cut_lap(const fs::path& folder, double fraction) {
  const std::string bytes = bytes_of(short_lap());
  const fs::path file = folder / "cut.mcap";
  std::ofstream(file, std::ios::binary)
      << bytes.substr(0, static_cast<std::size_t>(fraction * static_cast<double>(bytes.size())));
  return file.string();
}

TEST(RecordingInfo, CountsAddUpAndAgreeWithQuickMode) {
  const auto info = look_at(short_lap(), false, {});
  const auto quick = look_at(short_lap(), true, {});
  ASSERT_TRUE(info && quick) << to_string(info.error());
  std::uint64_t sum = 0;
  for (const TopicReport& topic : info->report.topics) sum += topic.messages;
  EXPECT_EQ(sum, info->report.messages);
  EXPECT_EQ(quick->report.messages, info->report.messages);
  EXPECT_NEAR(quick->report.duration_s, info->report.duration_s, 1e-6);
  EXPECT_NEAR(info->report.duration_s, 4, 0.2);
  EXPECT_THAT(info->problems, IsEmpty());
  EXPECT_EQ(info->attachments.size(), 2U);
  EXPECT_TRUE(info->summary.complete);
  ASSERT_TRUE(info->setup.camera);
  const Eigen::Vector3d ahead(0.2, -0.1, 1);
  EXPECT_LT((*info->setup.camera->project(ahead) - *test::limo().camera.project(ahead)).norm(), 1e-9);
}

TEST(RecordingInfo, TextAndJsonHaveTheSameContent) {
  const auto info = look_at(short_lap(), false, {});
  ASSERT_TRUE(info);
  const std::string text = to_text(*info);
  const auto json = to_json(fields(*info));
  EXPECT_EQ(json["file"], short_lap());
  EXPECT_EQ(json["messages"], info->report.messages);
  EXPECT_THAT(text, HasSubstr(std::to_string(info->report.messages) + " messages in "));
  for (const auto& topic : json["topics"]) {
    EXPECT_THAT(text, HasSubstr(topic["topic"].get<std::string>()));
    EXPECT_TRUE(topic.contains("gaps"));
  }
  EXPECT_THAT(text, AllOf(HasSubstr("metadata waymark\n  anchor: tag36h11:0"),
                          HasSubstr("robot.yaml (application/yaml")));
  EXPECT_THAT(text, HasSubstr("'" + short_lap() + "'")) << "file names with a space are quoted in commands";
  EXPECT_EQ(json["next"].size(), next_steps(*info).size());
  EXPECT_THAT(text, HasSubstr("s on the robot's clock")) << "the clock of a simulated lap starts at 0";
}

TEST(RecordingInfo, TwoClocksAreATrap) {
  const fs::path folder = testing::fresh_folder("jobs_info_clocks");
  const std::string lap = test::record_lap(folder / "lap.mcap", 15, {.for_s = 4, .motion_ahead_s = 3600});
  const auto info = look_at(lap, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  const auto trap = std::ranges::find(info->problems, "clocks", &LogProblem::key);
  ASSERT_NE(trap, info->problems.end());
  EXPECT_EQ(trap->kind, LogProblem::Kind::Trap);
  EXPECT_THAT(trap->error.message, HasSubstr("3600 s"));
}

TEST(RecordingInfo, TheSourceOfTheOdometryIsNamed) {
  EXPECT_EQ(to_json(fields(look_at(short_lap(), true, {}).value()))["odometry"], "/odom");
  const fs::path folder = testing::fresh_folder("jobs_info_transforms");
  const std::string lap =
      test::record_lap(folder / "lap.mcap", 15, {.for_s = 4, .odometry_in_transforms = true});
  const auto info = look_at(lap, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_EQ(to_json(fields(*info))["odometry"], "/tf (odom to base_link)");
  EXPECT_THAT(to_text(*info), HasSubstr("/tf (odom to base_link)"));
  EXPECT_THAT(info->contents, Contains("odometry"));
  EXPECT_THAT(info->problems, IsEmpty());
}

TEST(RecordingInfo, DepthImagesAreNotContents) {
  const fs::path file = testing::fresh_folder("jobs_info_depth") / "depth.mcap";
  auto recorder = SampleRecorder::open(std::move(*create_file(file)));
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add_message("/depth/compressedDepth", SensorTime(std::chrono::seconds(1)),
                                    ros2::CompressedImage{.data = Bytes(40)}));
  ASSERT_TRUE(recorder->close());
  const auto info = look_at(file.string(), false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_FALSE(info->contents.contains("images"));
  ASSERT_FALSE(info->problems.empty());
  EXPECT_EQ(info->problems.front().error.place.key, "/depth/compressedDepth");
}

TEST(RecordingInfo, QuickModeOmitsStamps) {
  const auto quick = look_at(short_lap(), true, {});
  ASSERT_TRUE(quick);
  EXPECT_FALSE(to_json(fields(*quick))["topics"][0].contains("gaps"));
  EXPECT_THAT(to_text(*quick), Not(HasSubstr("\nstamps\n")));
}

TEST(RecordingInfo, ACalendarClockIsPrintedAsADate) {
  RecordingInfo info{.file = "a.mcap"};
  info.report.start_ns = 1'700'000'000'000'000'000;
  EXPECT_THAT(to_text(info), HasSubstr("start       2023-11-14 22:13:20 UTC"));
  info.report.start_ns = 12'345'000'000;
  EXPECT_THAT(to_text(info), HasSubstr("start       12.345 s on the robot's clock"));
}

TEST(RecordingInfo, ReportsProgressAndPartialCountsOnCancellation) {
  int reports = 0;
  JobControl control;
  control.progress = [&](const JobProgress& now) {
    EXPECT_THAT(now.text, HasSubstr("my lap.mcap: "));
    ++reports;
  };
  const auto whole = look_at(short_lap(), false, control);
  ASSERT_TRUE(whole);
  EXPECT_GT(reports, 2);
  const int all = reports;
  reports = 0;
  control.cancelled = [&] { return reports > all / 2; };
  const auto part = look_at(short_lap(), false, control);
  ASSERT_TRUE(part) << to_string(part.error());
  EXPECT_LT(part->report.messages, whole->report.messages);
  EXPECT_GT(part->report.messages, 0U);
}

TEST(RecordingInfo, OtherFilesAreErrorsWithTheirPlace) {
  const fs::path folder = testing::fresh_folder("jobs_info_none");
  const auto missing = look_at("/nowhere/lap.mcap", false, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.source, "/nowhere/lap.mcap");
  std::ofstream(folder / "text.mcap") << "not a recording";
  const auto text = look_at((folder / "text.mcap").string(), false, {});
  ASSERT_FALSE(text);
  EXPECT_THAT(to_string(text.error()), HasSubstr("text.mcap"));
  EXPECT_FALSE(look_at(folder.string(), false, {}));
}

TEST(RecordingInfo, ADamagedFileIsReadUpToTheDamage) {
  const fs::path folder = testing::fresh_folder("jobs_info_cut");
  const auto info = look_at(cut_lap(folder, 0.6), false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_FALSE(info->problems.empty());
  EXPECT_FALSE(info->summary.complete);
  const auto json = to_json(fields(*info));
  EXPECT_FALSE(json["problems"].empty());
  EXPECT_FALSE(json["complete"].get<bool>());
}

TEST(RecoverLog, TheIntactPartOfATruncatedFileIsARecording) {
  const fs::path folder = testing::fresh_folder("jobs_recover");
  const std::string cut = cut_lap(folder, 0.6);
  const auto report = recover_log({.file = cut});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->output, (folder / "cut.recovered.mcap").string());
  EXPECT_FALSE(report->recovery.was_whole);
  const auto info = look_at(report->output, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_THAT(info->problems, IsEmpty());
  EXPECT_TRUE(info->summary.complete);
  EXPECT_EQ(info->report.messages, report->recovery.messages);
  EXPECT_LT(info->report.messages, look_at(short_lap(), true, {})->report.messages);
  EXPECT_GT(info->report.messages, 0U);
  EXPECT_THAT(to_text(*report), HasSubstr("bytes of " + cut + " are lost"));
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["messages"], report->recovery.messages);
  EXPECT_FALSE(json["problems"].empty());
}

TEST(RecoverLog, AnIntactFileKeepsItsMessages) {
  const fs::path folder = testing::fresh_folder("jobs_recover_whole");
  const auto report = recover_log({.file = short_lap(), .output = (folder / "again.mcap").string()});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(report->recovery.was_whole);
  EXPECT_EQ(report->recovery.messages, look_at(short_lap(), true, {})->report.messages);
  EXPECT_THAT(to_text(*report), HasSubstr("was intact"));
}

TEST(RecoverLog, NothingIsOverwrittenAndAFailureLeavesNoFile) {
  const fs::path folder = testing::fresh_folder("jobs_recover_none");
  const std::string cut = cut_lap(folder, 0.6);
  const std::string before = bytes_of(cut);
  for (const std::string& there : {cut, (folder / "there.mcap").string()}) {
    if (there != cut) std::ofstream(there) << "older";
    const auto refused = recover_log({.file = cut, .output = there});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unwritable);
    EXPECT_EQ(refused.error().place.source, there);
  }
  EXPECT_TRUE(bytes_of(cut) == before);
  EXPECT_EQ(test::file_text(folder / "there.mcap"), "older");
  const std::string head = cut_lap(testing::fresh_folder("jobs_recover_head"), 0.001);
  const auto nothing = recover_log({.file = head});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(test::names_in(fs::path(head).parent_path()), std::vector<std::string>{"cut.mcap"});
  EXPECT_FALSE(recover_log({.file = cut, .output = "/nowhere/deep/out.mcap"}));
  EXPECT_FALSE(recover_log({.file = "/nowhere/lap.mcap"}));
}

RecordingInfo holding(LogContents contents) {
  RecordingInfo info{.file = "lap.mcap", .contents = std::move(contents)};
  info.report.messages = 10;
  info.setup.metadata["waymark"] = {{"anchor", "tag36h11:0"}, {"tag_size_m", "0.16"}};
  info.setup.camera = read_robot(WAYMARK_SHARE "/robots/limo.yaml")->camera;
  info.setup.base_T_cam = SE3();
  return info;
}

std::vector<std::string> commands(const RecordingInfo& info) {
  std::vector<std::string> all;
  for (const NextStep& step : next_steps(info)) {
    EXPECT_FALSE(step.sentence.empty());
    all.push_back(step.command);
  }
  return all;
}

TEST(NextSteps, ALapWithItsRobotNeedsNoFlags) {
  EXPECT_THAT(commands(holding({"tags", "odometry"})),
              ElementsAre("waymark map lap.mcap -o map", "waymark localize lap.mcap --map map",
                          "waymark play lap.mcap"));
}

TEST(NextSteps, MissingDataAreFlags) {
  RecordingInfo info = holding({"tags", "odometry"});
  info.setup.metadata.clear();
  EXPECT_THAT(commands(info), Contains("waymark map lap.mcap --anchor tag36h11:0 --tag-size-m 0.16 -o map"));
  info.setup.camera.reset();
  EXPECT_THAT(commands(info), Contains(AllOf(StartsWith("waymark map"), HasSubstr("--robot robot.yaml"))));
  EXPECT_THAT(commands(info),
              Contains(AllOf(StartsWith("waymark localize"), HasSubstr("--robot robot.yaml"))));
  info.setup.chosen.ambiguous = Error{ErrorCode::InvalidArgument, "two cameras", {}, {}};
  EXPECT_THAT(commands(info), Contains(HasSubstr("--camera-topic")));
}

TEST(NextSteps, VerbsDependOnTheContents) {
  EXPECT_THAT(commands(holding({"images", "odometry"})), Contains("waymark detect lap.mcap"));
  EXPECT_THAT(commands(holding({"images", "odometry"})), Contains("waymark map lap.mcap -o map"));
  EXPECT_THAT(commands(holding({"tags"})), Contains(HasSubstr("odometry.csv")));
  EXPECT_THAT(commands(holding({"tag_poses", "odometry"})), Contains(StartsWith("waymark map lap.mcap")));
  EXPECT_THAT(commands(holding({"range_bearing", "odometry"})),
              Contains("waymark localize lap.mcap --map map"));
  EXPECT_THAT(commands(holding({"imu"})), Contains(HasSubstr("detections.csv")));
  EXPECT_THAT(commands(holding({})), ElementsAre("waymark play --messages lap.mcap"));
  RecordingInfo nothing = holding({});
  nothing.report.messages = 0;
  EXPECT_TRUE(commands(nothing).empty());
}

TEST(NextSteps, ATruncatedRecordingIsRecoveredAndABagIsConverted) {
  RecordingInfo cut = holding({"tags", "odometry"});
  cut.summary.complete = false;
  EXPECT_EQ(commands(cut).front(), "waymark recover lap.mcap");
  cut.file = "/data/laps/lap.mcap";
  EXPECT_EQ(commands(cut).front(), "waymark recover /data/laps/lap.mcap -o lap.recovered.mcap")
      << "the folder of the recording may be read-only";
  RecordingInfo bag = holding({"tags", "odometry"});
  bag.file = "/data/lap.bag";
  bag.format = LogFormat::Ros1Bag;
  EXPECT_EQ(commands(bag).front(), "waymark convert /data/lap.bag lap.bag.mcap");
}

TEST(NextSteps, NamesWithShellCharactersAreQuoted) {
  RecordingInfo info = holding({"tags", "odometry", "images"});
  info.file = "my laps/it's $HOME.mcap";
  info.summary.complete = false;
  const std::string quoted = R"('my laps/it'\''s $HOME.mcap')";
  for (const std::string& command : commands(info)) EXPECT_THAT(command, HasSubstr(quoted)) << command;
  EXPECT_THAT(commands(info).front(), HasSubstr(R"(-o 'it'\''s $HOME.recovered.mcap')"));
}

TEST(ShellWord, OnlyWordsWithShellCharactersAreQuoted) {
  EXPECT_EQ(shell_word("lap.2-b_c/d@e.mcap"), "lap.2-b_c/d@e.mcap");
  EXPECT_EQ(shell_word(""), "''");
  EXPECT_EQ(shell_word("a b"), "'a b'");
  EXPECT_EQ(shell_word("~/lap"), "'~/lap'");
  EXPECT_EQ(shell_word("'"), R"(''\''')");
  EXPECT_EQ(shell_word("a;rm"), "'a;rm'");
}

class LookAt : public ::testing::Test {
 protected:
  // Not shared by the suite, because CTest runs several tests at the same time, each in its own process.
  std::string file_ = test::record_lap(testing::fresh_folder("jobs_look_at") / "lap.mcap", 21, {.for_s = 3});
};

TEST_F(LookAt, TheSummaryContainsTopicsAttachmentsAndNextSteps) {
  const auto info = look_at(file_, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  const auto json = to_json(fields(*info));
  EXPECT_EQ(json["file"], file_);
  EXPECT_EQ(json["format"], "mcap");
  EXPECT_EQ(json["complete"], true);
  EXPECT_NEAR(json["duration_s"].get<double>(), 3, 0.3);
  std::uint64_t messages = 0;
  for (const auto& topic : json["topics"]) {
    messages += topic["messages"].get<std::uint64_t>();
    EXPECT_TRUE(topic.contains("gaps")) << topic["topic"];
  }
  EXPECT_EQ(json["messages"], messages);
  EXPECT_EQ(json["metadata"]["waymark"]["tag_size_m"], "0.16");
  EXPECT_EQ(json["attachments"].size(), 2U);
  EXPECT_EQ(json["problems"].size(), 0U);
  EXPECT_EQ(json["next"].size(), next_steps(*info).size());
}

TEST_F(LookAt, QuickOmitsStamps) {
  const auto info = look_at(file_, true, {});
  ASSERT_TRUE(info);
  const auto json = to_json(fields(*info));
  ASSERT_FALSE(json["topics"].empty());
  for (const auto& topic : json["topics"]) EXPECT_FALSE(topic.contains("gaps"));
}

TEST_F(LookAt, CancellingReportsThePartThatWasRead) {
  std::string progress;
  JobControl control = test::cancelled_after(50);
  control.progress = [&](const JobProgress& now) { progress = now.text; };
  const auto some = look_at(file_, false, control);
  ASSERT_TRUE(some) << to_string(some.error());
  EXPECT_LT(some->report.messages, look_at(file_, false, {})->report.messages);
  EXPECT_THAT(progress, StartsWith(file_ + ": "));
}

TEST_F(LookAt, ATruncatedFileIsReportedWithTheCommandToRecoverIt) {
  const std::string cut = file_ + ".cut.mcap";
  std::filesystem::copy_file(file_, cut, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
  const auto info = look_at(cut, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_FALSE(info->summary.complete);
  EXPECT_EQ(to_json(fields(*info))["complete"], false);
  EXPECT_THAT(commands(*info).front(), StartsWith("waymark recover"));
}

}  // namespace
}  // namespace waymark
