// Parts of a recording, and its lines as they are played.
#include "waymark/app/convert/play_log.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<MessageLog> open_lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_play") / "lap.mcap", 9, {.for_s = 4});
  auto log = open_log(file, {});
  EXPECT_TRUE(log) << to_string(log.error());
  return std::move(*log);
}

/// The messages of a part, without waiting.
std::size_t messages_of(const LogPart& part) {
  const auto log = open_lap();
  const auto selection = select_part(*log, part);
  EXPECT_TRUE(selection) << to_string(selection.error());
  std::size_t count = 0;
  const auto add = [&](const LogChannel&, const LogMessage&) -> Status {
    ++count;
    return {};
  };
  EXPECT_TRUE(play_messages(*log, *selection, 0, add, [] { return false; }));
  return count;
}

std::vector<std::string> lines_of(const PlayOptions& options, const LogPart& part = {}) {
  const auto log = open_lap();
  std::vector<std::string> lines;
  const auto take = [&](const std::string& line) {
    lines.push_back(line);
    return true;
  };
  EXPECT_TRUE(play_log(*log, select_part(*log, part).value(), options, take, [] { return false; }));
  return lines;
}

TEST(SelectPart, TimesDivideARecordingWithoutLossAndWithoutOverlap) {
  const std::size_t all = messages_of({});
  ASSERT_GT(all, 100U);
  for (const double cut_s : {0.5, 1.0, 2.25, 3.9}) {
    const std::size_t before = messages_of({.to_s = cut_s});
    EXPECT_EQ(before + messages_of({.from_s = cut_s}), all) << cut_s;
    EXPECT_EQ(messages_of({.to_s = cut_s / 2}) + messages_of({.from_s = cut_s / 2, .to_s = cut_s}), before);
  }
}

TEST(SelectPart, TopicsDivideARecordingToo) {
  const auto log = open_lap();
  std::size_t sum = 0;
  for (const LogChannel& channel : log->channels()) sum += messages_of({.topics = {channel.topic}});
  EXPECT_EQ(sum, messages_of({}));
}

TEST(SelectPart, RefusesWhatIsNotInTheRecordingAndTimesThatAreNone) {
  const auto log = open_lap();
  const auto misspelt = select_part(*log, {.topics = {"/odom", "/odmo"}});
  ASSERT_FALSE(misspelt);
  EXPECT_EQ(misspelt.error().code, ErrorCode::NotFound);
  EXPECT_THAT(misspelt.error().hint, HasSubstr("/odom"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const LogPart& part :
       {LogPart{.from_s = -1}, LogPart{.from_s = 2, .to_s = 2}, LogPart{.from_s = 3, .to_s = 2},
        LogPart{.from_s = nan}, LogPart{.to_s = nan}, LogPart{.from_s = 1000}})
    EXPECT_FALSE(select_part(*log, part)) << part.from_s << " to " << part.to_s;
}

TEST(PlayLog, EveryLineOfJsonIsAnObjectAndThereIsOneForEachLineOfWords) {
  const LogPart part{.topics = {"/odom", "/tag_detections"}, .to_s = 1};
  for (const bool messages : {false, true}) {
    const auto json = lines_of({.speed = 0, .messages = messages, .json = true}, part);
    EXPECT_EQ(json.size(), lines_of({.speed = 0, .messages = messages}, part).size());
    for (const std::string& line : json) {
      ASSERT_EQ(std::ranges::count(line, '\n'), 1);
      EXPECT_TRUE(nlohmann::json::parse(line).is_object()) << line;
    }
  }
  EXPECT_EQ(lines_of({.speed = 0, .messages = true}, part).size(), messages_of(part));
}

TEST(PlayLog, EndsWhenItsReaderHasEnoughOrItIsCancelled) {
  const auto log = open_lap();
  int lines = 0;
  const Status enough = play_log(
      *log, {}, {.speed = 0}, [&](const std::string&) { return ++lines < 3; }, [] { return false; });
  EXPECT_FALSE(enough);
  EXPECT_EQ(lines, 3);
  const Status cancelled = play_log(
      *log, {}, {.speed = 0}, [&](const std::string&) { return ++lines > 0; }, [] { return true; });
  EXPECT_FALSE(cancelled);
  EXPECT_EQ(lines, 3) << "nothing after it was cancelled";
}

}  // namespace
}  // namespace waymark
