// Selecting part of a recording, and printing it as lines.
#include "waymark/app/convert/play_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SensorTime second(double s) { return SensorTime(Duration(std::llround(s * 1e9))); }

/// One sample of every kind.
std::vector<Sample> all_kinds() {
  TagFrame tags{.stamp = second(12), .camera = "left", .detections = std::vector<TagDetection>(2)};
  tags.detections[0].tag = {FamilyId::Tag36h11, 7};
  tags.detections[0].corners_px = {Eigen::Vector2d(1, 2), {3, 4}, {5, 6}, {7, 8}};
  tags.detections[1].tag = {FamilyId::Tag25h9, 1};
  return {tags,
          Odometry{second(12), SE2(1, -2, M_PI / 2), 0.25, -0.5},
          WheelTicks{second(12), 1.5, 2.5},
          ImuSample{second(12), {0.1, 0.2, 0.3}, {0, 0, 9.8}},
          StampedCommand{second(12), {0.3, 0.4}},
          TruthPose{second(12), lift(SE2(3, 4, 0))},
          CameraFrame{.stamp = second(12), .image = Image(64, 48)},
          TagPoseFrame{second(12), "cam", {{{FamilyId::Tag36h11, 5}, SE3(SO3(), {0, 3, 4})}}},
          RangeBearing{second(12), 9, 2.5, M_PI / 6},
          LaserScan{.stamp = second(12),
                    .angle_min_rad = -1,
                    .angle_increment_rad = 1,
                    .range_min_m = 0.1,
                    .range_max_m = 5,
                    .ranges_m = {1, std::numeric_limits<float>::infinity(), 9}},
          GamepadState{second(12), {0.5F, -1}, {0, 1}}};
}

TEST(SampleText, EveryKindHasAUniqueNameOneLineAndAnObject) {
  std::set<std::string> kinds;
  for (const Sample& sample : all_kinds()) {
    kinds.insert(kind_of(sample));
    const std::string text = to_text(sample, second(2));
    EXPECT_THAT(text, HasSubstr("10.000"));
    EXPECT_THAT(text, HasSubstr(kind_of(sample)));
    EXPECT_EQ(std::ranges::count(text, '\n'), 1) << text;
    const Json json = to_json(fields(sample));
    EXPECT_EQ(json["kind"], kind_of(sample));
    EXPECT_EQ(json["stamp_ns"], 12'000'000'000);
    EXPECT_EQ(json_line(Json::parse(json_line(json))), json_line(json))
        << "parsing a line and writing it again leaves it unchanged";
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<Sample>);
}

TEST(SampleText, ValuesHaveUnits) {
  const auto text = [](std::size_t kind) { return to_text(all_kinds()[kind], second(0)); };
  EXPECT_THAT(text(0), HasSubstr("tag36h11:7 tag25h9:1"));
  EXPECT_THAT(text(1), HasSubstr("x 1.000 m, y -2.000 m, yaw 90.00 deg, 0.250 m/s, -0.500 rad/s"));
  EXPECT_THAT(text(6), HasSubstr("64 x 48 px"));
  EXPECT_THAT(text(7), HasSubstr("tag36h11:5 at 5.000 m"));
  EXPECT_THAT(text(8), HasSubstr("landmark 9: 2.500 m, 30.00 deg"));
  EXPECT_THAT(text(9), HasSubstr("3 rays, 1 echoes")) << "a distance beyond the range is not an echo";
  EXPECT_THAT(to_text(TagFrame{}, second(0)), HasSubstr("none"));
  EXPECT_THAT(to_text(TagPoseFrame{}, second(0)), HasSubstr("none"));
}

TEST(SampleText, TheObjectContainsTheValues) {
  const auto json = [](std::size_t kind) { return to_json(fields(all_kinds()[kind])); };
  EXPECT_EQ(json(0)["camera"], "left");
  EXPECT_EQ(json(0)["detections"][0]["corners_px"], Json::parse("[[1.0,2.0],[3.0,4.0],[5.0,6.0],[7.0,8.0]]"));
  EXPECT_NEAR(json(1)["odom_T_base"]["yaw_rad"].get<double>(), M_PI / 2, 1e-12);
  EXPECT_EQ(json(3)["linear_acceleration_m_s2"], Json::parse("[0.0,0.0,9.8]"));
  EXPECT_EQ(json(5)["map_T_base"]["translation_m"], Json::parse("[3.0,4.0,0.0]"));
  EXPECT_EQ(json(5)["map_T_base"]["quaternion_xyzw"][3], 1.0);
  EXPECT_FALSE(json(6).contains("pixels"));
  EXPECT_THAT(json_line(fields(all_kinds()[9])), HasSubstr(R"("ranges_m":[1.0,null,9.0])"))
      << "JSON cannot represent infinity";
  EXPECT_EQ(json(10)["buttons"], Json::parse("[0,1]"));
}

TEST(SampleText, NonFiniteNumbersAreNull) {
  const auto line_of = [](const Sample& sample) { return Json::parse(json_line(fields(sample))); };
  const Json odometry = line_of(Odometry{second(1), SE2(kNan, 0, 0), kNan, 0});
  EXPECT_TRUE(odometry["odom_T_base"]["x_m"].is_null());
  EXPECT_TRUE(odometry["speed_m_s"].is_null());
  EXPECT_EQ(odometry["yaw_rate_rad_s"], 0.0);
  const Json range = line_of(RangeBearing{second(1), 1, std::numeric_limits<double>::infinity(), 0});
  EXPECT_TRUE(range["range_m"].is_null());
}

std::unique_ptr<MessageLog> open_lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_play") / "lap.mcap", 9, {.for_s = 4});
  auto log = open_log(file, {});
  EXPECT_TRUE(log) << to_string(log.error());
  return std::move(*log);
}

/// The number of messages in a part.
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

TEST(SelectPart, IntervalsDivideARecordingWithoutLossOrOverlap) {
  const std::size_t all = messages_of({});
  ASSERT_GT(all, 100U);
  for (const double cut_s : {0.5, 1.0, 2.25, 3.9}) {
    const std::size_t before = messages_of({.to_s = cut_s});
    EXPECT_EQ(before + messages_of({.from_s = cut_s}), all) << cut_s;
    EXPECT_EQ(messages_of({.to_s = cut_s / 2}) + messages_of({.from_s = cut_s / 2, .to_s = cut_s}), before);
  }
}

TEST(SelectPart, TopicsDivideARecording) {
  const auto log = open_lap();
  std::size_t sum = 0;
  for (const LogChannel& channel : log->channels()) sum += messages_of({.topics = {channel.topic}});
  EXPECT_EQ(sum, messages_of({}));
}

TEST(SelectPart, RejectsUnknownTopicsAndInvalidIntervals) {
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

TEST(PlayLog, JsonHasOneObjectPerLineOfText) {
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

TEST(PlayLog, EndsIfTheReaderStopsOrIfCancelled) {
  const auto log = open_lap();
  int lines = 0;
  const Status stopped = play_log(
      *log, {}, {.speed = 0}, [&](const std::string&) { return ++lines < 3; }, [] { return false; });
  EXPECT_FALSE(stopped);
  EXPECT_EQ(lines, 3);
  const Status cancelled = play_log(
      *log, {}, {.speed = 0}, [&](const std::string&) { return ++lines > 0; }, [] { return true; });
  EXPECT_FALSE(cancelled);
  EXPECT_EQ(lines, 3) << "no line is printed after cancellation";
}

}  // namespace
}  // namespace waymark
