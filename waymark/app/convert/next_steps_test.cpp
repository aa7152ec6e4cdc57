// What `waymark info` advises: commands that can be copied, for what a recording holds and what it lacks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/convert/recording_info.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

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

TEST(NextSteps, ALapThatKnowsItsRobotNeedsNoFlags) {
  EXPECT_THAT(commands(holding({"tags", "odometry"})),
              ElementsAre("waymark map lap.mcap -o map", "waymark localize lap.mcap --map map",
                          "waymark play lap.mcap"));
}

TEST(NextSteps, WhatTheRecordingLacksIsAFlag) {
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

TEST(NextSteps, EachKindOfRecordingHasItsVerbs) {
  EXPECT_THAT(commands(holding({"pictures", "odometry"})), Contains("waymark detect lap.mcap"));
  EXPECT_THAT(commands(holding({"pictures", "odometry"})), Contains("waymark map lap.mcap -o map"));
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

TEST(NextSteps, ACutRecordingIsRecoveredAndAForeignOneConverted) {
  RecordingInfo cut = holding({"tags", "odometry"});
  cut.summary.complete = false;
  EXPECT_EQ(commands(cut).front(), "waymark recover lap.mcap");
  cut.file = "/data/laps/lap.mcap";
  EXPECT_EQ(commands(cut).front(), "waymark recover /data/laps/lap.mcap -o lap.recovered.mcap")
      << "beside the recording one may not be allowed to write";
  RecordingInfo bag = holding({"tags", "odometry"});
  bag.file = "/data/lap.bag";
  bag.format = LogFormat::Ros1Bag;
  EXPECT_EQ(commands(bag).front(), "waymark convert /data/lap.bag lap.bag.mcap");
}

TEST(NextSteps, NamesThatAShellWouldReadAreQuoted) {
  RecordingInfo info = holding({"tags", "odometry", "pictures"});
  info.file = "my laps/it's $HOME.mcap";
  info.summary.complete = false;
  const std::string quoted = R"('my laps/it'\''s $HOME.mcap')";
  for (const std::string& command : commands(info)) EXPECT_THAT(command, HasSubstr(quoted)) << command;
  EXPECT_THAT(commands(info).front(), HasSubstr(R"(-o 'it'\''s $HOME.recovered.mcap')"));
}

TEST(ShellWord, OnlyWhatAShellWouldReadIsQuoted) {
  EXPECT_EQ(shell_word("lap.2-b_c/d@e.mcap"), "lap.2-b_c/d@e.mcap");
  EXPECT_EQ(shell_word(""), "''");
  EXPECT_EQ(shell_word("a b"), "'a b'");
  EXPECT_EQ(shell_word("~/lap"), "'~/lap'");
  EXPECT_EQ(shell_word("'"), R"(''\''')");
  EXPECT_EQ(shell_word("a;rm"), "'a;rm'");
}

class LookAt : public ::testing::Test {
 protected:
  // Not once for the suite: CTest runs each test in a process of its own, several at once.
  std::string file_ = test::record_lap(testing::fresh_folder("jobs_look_at") / "lap.mcap", 21, {.for_s = 3});
};

TEST_F(LookAt, TheSummaryNamesTopicsAttachmentsAndWhatToDo) {
  const auto info = look_at(file_, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  const auto json = to_json(*info);
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

TEST_F(LookAt, QuickSaysNothingOfStamps) {
  const auto info = look_at(file_, true, {});
  ASSERT_TRUE(info);
  const auto json = to_json(*info);
  ASSERT_FALSE(json["topics"].empty());
  for (const auto& topic : json["topics"]) EXPECT_FALSE(topic.contains("gaps"));
}

TEST_F(LookAt, CancellingEndsTheCountingAndTellsWhatWasRead) {
  std::string told;
  JobControl control = test::cancelled_after(50);
  control.progress = [&](const JobProgress& now) { told = now.words; };
  const auto some = look_at(file_, false, control);
  ASSERT_TRUE(some) << to_string(some.error());
  EXPECT_LT(some->report.messages, look_at(file_, false, {})->report.messages);
  EXPECT_THAT(told, StartsWith(file_ + ": "));
}

TEST_F(LookAt, OfACutFileItSaysSoAndHowToMendIt) {
  const std::string cut = file_ + ".cut.mcap";
  std::filesystem::copy_file(file_, cut, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
  const auto info = look_at(cut, false, {});
  ASSERT_TRUE(info) << to_string(info.error());
  EXPECT_FALSE(info->summary.complete);
  EXPECT_EQ(to_json(*info)["complete"], false);
  EXPECT_THAT(commands(*info).front(), StartsWith("waymark recover"));
}

}  // namespace
}  // namespace waymark
