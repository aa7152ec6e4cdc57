// Tests localising a robot that is driven by another program, in the robot loop, with a simulated robot and
// clock.
#include "waymark/runtime/localize_session.hpp"

#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/tiny_robot.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A tag on a wall; the filter starts at the true pose and follows odometry.
Localizer localizer(bool placed) {
  TagMap map;
  map.tags[TagId{FamilyId::Tag36h11, 99}] = {.map_T_tag = SE3({}, {3, 0, 0.3}), .size_m = 0.2};
  const PinholeRadtan projection{.fx = 400, .fy = 400, .cx = 320, .cy = 240};
  Localizer made = Localizer::make({.landmarks = Landmarks(map),
                                    .tags = map,
                                    .sensor = {CameraModel::make(projection, 640, 480).value(), SE3()}})
                       .value();
  if (placed) made.method().start_from(SE2(), 0.05, 0.05);
  return made;
}

struct Drive {
  explicit Drive(const LocalizeSessionOptions& options = {}, bool placed = true)
      : session(
            localizer(placed),
            {.on_sample =
                 [this](const Sample& sample) {
                   commands += std::holds_alternative<StampedCommand>(sample) ? 1 : 0;
                   return fails ? Status(fail(ErrorCode::Unwritable, "disk full")) : Status();
                 },
             .on_estimate =
                 [this](const LocalizationEstimate& estimate) {
                   estimates.push_back(estimate);
                   return Status();
                 },
             .on_report =
                 [this](SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
                   reports.push_back(now);
                   if (!estimate) unknown.push_back(now);
                 },
             .on_message = [this](const std::string& sentence) { words.push_back(sentence); }},
            [this](Duration uptime) {
              SessionRequest request{.end = button_at && uptime >= *button_at};
              if (given_at && uptime >= *given_at) request.pose = std::exchange(given, std::nullopt);
              return request;
            },
            options) {}

  Result<LocalizeEnd> drive() {
    (void)robot.command({0.2, 0});  // sent by another program
    RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 30, .listen_only = true});
    RobotListener listener = session.listener();
    listener.should_stop = [this] { return stop_at && robot.clock >= *stop_at; };
    const auto end = loop.drive(listener);
    if (!end) return tl::unexpected(end.error());
    return session.end(*end);
  }

  test::TinyRobot robot{};
  std::optional<Duration> stop_at{};
  std::optional<Duration> button_at{};
  std::optional<Duration> given_at{};
  std::optional<GivenPose> given{};
  bool fails = false;
  int commands = 0;
  std::vector<LocalizationEstimate> estimates{};
  std::vector<SensorTime> reports{};
  std::vector<SensorTime> unknown{};  ///< number of reports without an estimate
  std::vector<std::string> words{};
  LocalizeSession session;
};

TEST(LocalizeSession, SendsNoCommandsAndReportsEstimates) {
  Drive drive({.most_s = 5});
  const auto end = drive.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_FALSE(end->interrupted);
  EXPECT_NEAR(end->seconds, 5, 0.1);
  EXPECT_EQ(drive.robot.last(), (VelocityCommand{0.2, 0}))
      << "the other program's command stays, also after the end";
  EXPECT_NEAR(drive.robot.x_m(), 1, 0.05);
  EXPECT_EQ(drive.commands, 0) << "a command that was not sent is not recorded";
  ASSERT_FALSE(drive.estimates.empty());
  EXPECT_NEAR(drive.estimates.back().map_T_base.x(), drive.robot.x_m(), 0.05);
  for (std::size_t i = 1; i < drive.estimates.size(); ++i)
    ASSERT_GT(drive.estimates[i].stamp, drive.estimates[i - 1].stamp);
  EXPECT_TRUE(drive.words.empty());
}

TEST(LocalizeSession, ReportsAtTheGivenRate) {
  Drive drive({.report_every = milliseconds(500), .most_s = 4});
  ASSERT_TRUE(drive.drive());
  ASSERT_GE(drive.reports.size(), 8U);
  EXPECT_LE(drive.reports.size(), 9U);
  for (std::size_t i = 1; i < drive.reports.size(); ++i)
    EXPECT_NEAR(to_seconds(drive.reports[i] - drive.reports[i - 1]), 0.5, 0.051);
}

TEST(LocalizeSession, EndsByRequestAndBySignal) {
  Drive button;
  button.button_at = seconds(2);
  auto end = button.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_NEAR(end->seconds, 2, 0.1);
  Drive signal;
  signal.stop_at = seconds(2);
  end = signal.drive();
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->finished);
  EXPECT_TRUE(end->interrupted);
  EXPECT_EQ(signal.robot.last(), (VelocityCommand{0.2, 0})) << "this program does not stop the robot";
}

TEST(LocalizeSession, ContinuesFromAGivenPose) {
  Drive drive({.most_s = 4});
  drive.given_at = seconds(2);
  drive.given = GivenPose{SE2(5, 1, 0), Eigen::Matrix3d::Identity() * 0.01};
  ASSERT_TRUE(drive.drive());
  EXPECT_NEAR(drive.estimates.back().map_T_base.x(), 5 + 2 * 0.2, 0.05);
  EXPECT_NEAR(drive.estimates.back().map_T_base.y(), 1, 0.05);
  EXPECT_THAT(drive.words, ElementsAre(AllOf(HasSubstr("5.00 m"), HasSubstr("1.00 m"), HasSubstr("0 deg"))));
  testing::expect_on_page("localize", drive.words.front());
}

TEST(LocalizeSession, ReportsEachSilenceOnce) {
  Drive drive({.most_s = 12});
  drive.robot.camera_silent = {seconds(2), seconds(6)};
  drive.robot.wheels_silent = {seconds(7), seconds(11)};
  ASSERT_TRUE(drive.drive());
  ASSERT_THAT(drive.words, ElementsAre(HasSubstr(" 2 s"), HasSubstr(" 2 s")));
  testing::expect_on_page("localize", drive.words[0] + "\n" + drive.words[1]);
}

TEST(LocalizeSession, StopsReportingAnOutdatedEstimate) {
  Drive drive({.report_every = milliseconds(100), .most_s = 12});
  drive.robot.wheels_silent = {seconds(5), seconds(10)};
  drive.robot.camera_silent = {seconds(5), seconds(10)};
  ASSERT_TRUE(drive.drive());
  ASSERT_FALSE(drive.unknown.empty());
  EXPECT_NEAR(to_seconds(drive.unknown.front() - drive.reports.front()), 7, 0.3);
  EXPECT_GE(drive.unknown.size(), 30U) << "until odometry resumes";
}

TEST(LocalizeSession, ReportsOnceThatTheTagsGiveNoPose) {
  Drive drive({.most_s = 8}, false);
  ASSERT_TRUE(drive.drive());
  EXPECT_TRUE(drive.estimates.empty());
  ASSERT_EQ(drive.words.size(), 1U);
  testing::expect_on_page("localize", drive.words.front());
}

TEST(LocalizeSession, ErrorsOfListenerAndRobotEndIt) {
  Drive full;
  full.fails = true;
  auto end = full.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "disk full");
  Drive dead;
  dead.robot.dies_after = seconds(1);
  end = dead.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
}

}  // namespace
}  // namespace waymark
