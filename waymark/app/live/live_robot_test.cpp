#include "waymark/app/live/live_robot.hpp"

#include <deque>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

RobotSetup setup() {
  RobotSetup made = load_setup("", "limo", 1).value();
  made.ground = {.robot = "process:python3 my_robot.py", .topics = ""};
  return made;
}

CommissionRecord passed(const RobotSetup& setup) {
  const RobotModel& model = setup.simulated.model;
  return {.passed = true,
          .robot = setup.ground.robot,
          .limits = model.limits,
          .wheel_radius_m = model.wheel_radius_m,
          .track_m = model.track_m};
}

TEST(CommissionLimit, AppliesToARealRobotUntilItsFirstDrivePassed) {
  RobotSetup robot = setup();
  const auto why = lacks_commission(robot, {});
  ASSERT_TRUE(why);
  testing::expect_on_page("live", *why);
  EXPECT_NE(why->find("`waymark commission robot='process:python3 my_robot.py' robot_file="),
            std::string::npos)
      << *why;
  EXPECT_FALSE(lacks_commission(robot, {.simulated = true}));
  EXPECT_FALSE(lacks_commission(robot, {.lockstep = true})) << "only a simulated robot runs in lockstep";
  robot.commissioned = passed(robot);
  EXPECT_FALSE(lacks_commission(robot, {}));
}

TEST(CommissionLimit, ReportsWhyAFirstDriveIsNotValid) {
  RobotSetup robot = setup();
  robot.commissioned = passed(robot);
  robot.simulated.model.track_m = 0.3;
  const auto changed = lacks_commission(robot, {});
  for (const char* part : {"wheels.track_m", "0.172", "0.3"})
    EXPECT_NE(changed->find(part), std::string::npos) << *changed;
  testing::expect_on_page("live", *changed);
  robot.commissioned->passed = false;
  robot.commissioned->failed = {"stop.kill"};
  const auto failed = lacks_commission(robot, {});
  EXPECT_NE(failed->find("(stop.kill)"), std::string::npos) << *failed;
  testing::expect_on_page("live", *failed);
}

constexpr MotionLimits kLimits{.speed_m_s = 1, .yaw_rate_rad_s = 2};

TEST(CommissionLimit, ScalesTheCommandOnTheSameArc) {
  const VelocityCommand slow = slowed({.speed_m_s = -0.6, .yaw_rate_rad_s = 1}, 0.15, kLimits);
  EXPECT_DOUBLE_EQ(slow.speed_m_s, -0.15);
  EXPECT_DOUBLE_EQ(slow.yaw_rate_rad_s, 0.25);
  const VelocityCommand turn{.yaw_rate_rad_s = 1};
  EXPECT_EQ(slowed(turn, 0.15, kLimits), turn);
}

TEST(CommissionLimit, KeepsWithinTheRobotsLimits) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const VelocityCommand fast = slowed({.speed_m_s = 9, .yaw_rate_rad_s = -9}, kAny, kLimits);
  EXPECT_DOUBLE_EQ(fast.speed_m_s, 1);
  EXPECT_DOUBLE_EQ(fast.yaw_rate_rad_s, -1) << "the arc is unchanged";
  const VelocityCommand spin = slowed({.speed_m_s = 0.1, .yaw_rate_rad_s = 20}, kAny, kLimits);
  EXPECT_DOUBLE_EQ(spin.speed_m_s, 0.01);
  EXPECT_DOUBLE_EQ(spin.yaw_rate_rad_s, 2);
  const VelocityCommand calm{.speed_m_s = 0.9, .yaw_rate_rad_s = 1.9};
  EXPECT_EQ(slowed(calm, kAny, kLimits), calm);
}

using std::chrono::milliseconds;

using std::chrono::seconds;

/// A robot whose clock is 1000 s ahead of the clock of this computer.
class AheadRobot final : public Source {
 public:
  Result<std::optional<RobotEvent>> next(Duration most) override {
    if (waiting.empty()) {
      std::this_thread::sleep_for(most);
      return std::optional<RobotEvent>();
    }
    started = true;
    RobotEvent event = waiting.front();
    waiting.pop_front();
    return std::optional(event);
  }
  [[nodiscard]] bool more() const override { return polled && !waiting.empty(); }
  [[nodiscard]] std::optional<SensorTime> now() const override {
    return started ? std::optional(SensorTime(steady_now() + seconds(1000))) : std::nullopt;
  }
  std::deque<RobotEvent> waiting{};
  bool polled = true;  ///< whether more() reports waiting events; if not, they are in a pipe that only next()
                       ///< reads
  bool started = false;
};

class ListCamera final : public LiveCamera {
 public:
  Result<std::optional<RobotEvent>> next(Duration /*most*/) override {
    if (broken) return fail(ErrorCode::NotFound, "unplugged");
    if (waiting.empty()) return std::optional<RobotEvent>();
    RobotEvent event = waiting.front();
    waiting.pop_front();
    return std::optional(event);
  }
  [[nodiscard]] bool more() const override { return broken || !waiting.empty(); }
  [[nodiscard]] std::optional<SensorTime> now() const override { return std::nullopt; }
  [[nodiscard]] CameraCounts counts() const override { return {}; }
  [[nodiscard]] std::string description() const override { return "list"; }
  void take_image(Duration stamp) { waiting.emplace_back(Sample(CameraFrame{.stamp = SensorTime(stamp)})); }
  std::deque<RobotEvent> waiting{};
  bool broken = false;
};

struct Rig {
  AheadRobot robot{};
  ListCamera* camera = nullptr;
  std::unique_ptr<RobotWithCameras> both{};
  Rig() {
    auto made = std::make_unique<ListCamera>();
    camera = made.get();
    std::vector<std::unique_ptr<LiveCamera>> cameras;
    cameras.push_back(std::move(made));
    both = std::make_unique<RobotWithCameras>(robot, std::move(cameras), std::set<std::string>{"cam"});
  }
};

TEST(RobotWithCameras, MovesStampsToTheRobotsClock) {
  Rig rig;
  rig.camera->take_image(steady_now());
  EXPECT_FALSE(*rig.both->next(milliseconds(10)));  // the robot's clock is still unknown
  rig.robot.waiting.emplace_back(Sample(Odometry{}));
  ASSERT_TRUE(*rig.both->next(milliseconds(10)));
  const Duration taken = steady_now() - milliseconds(30);
  rig.camera->take_image(taken);
  const auto event = rig.both->next(milliseconds(10));
  ASSERT_TRUE(event && *event);
  const SensorTime stamp = stamp_of(std::get<Sample>(**event));
  EXPECT_NEAR(to_seconds(stamp.time_since_epoch() - taken), 1000, 1e-3);
  rig.camera->take_image(taken - milliseconds(5));  // taken before the previous image
  const auto second = rig.both->next(milliseconds(10));
  ASSERT_TRUE(second && *second);
  EXPECT_GT(stamp_of(std::get<Sample>(**second)), stamp);
}

TEST(RobotWithCameras, SkipsImagesThatWaitedTooLong) {
  Rig rig;
  rig.robot.waiting.emplace_back(Sample(Odometry{}));
  ASSERT_TRUE(*rig.both->next(milliseconds(10)));
  rig.camera->take_image(steady_now() - milliseconds(1100));
  EXPECT_FALSE(*rig.both->next(milliseconds(10)));
  rig.camera->take_image(steady_now() - milliseconds(800));
  EXPECT_TRUE(*rig.both->next(milliseconds(10)));
}

TEST(RobotWithCameras, DoNotStarveTheRobot) {
  Rig rig;
  rig.robot.polled = false;
  rig.robot.waiting.emplace_back(Sample(Odometry{}));
  ASSERT_TRUE(*rig.both->next(milliseconds(10)));
  for (int i = 0; i < 5; ++i) {
    rig.camera->take_image(steady_now());
    rig.robot.waiting.emplace_back(Sample(Odometry{}));
  }
  int odometry = 0;
  for (int i = 0; i < 10; ++i) {
    rig.camera->take_image(steady_now());
    const auto event = rig.both->next(milliseconds(10));
    ASSERT_TRUE(event && *event);
    odometry += std::holds_alternative<Odometry>(std::get<Sample>(**event)) ? 1 : 0;
  }
  EXPECT_EQ(odometry, 5);
}

TEST(RobotWithCameras, ImagesReplaceTheDetectionsOfTheRobotForTheSameCamera) {
  Rig rig;
  rig.robot.waiting.emplace_back(Sample(TagPoseFrame{}));
  rig.robot.waiting.emplace_back(Sample(TagFrame{}));
  rig.robot.waiting.emplace_back(Sample(TagPoseFrame{.camera = "rear"}));
  rig.robot.waiting.emplace_back(Sample(Odometry{}));
  std::vector<RobotEvent> seen;
  for (int i = 0; i < 4; ++i)
    if (const auto event = rig.both->next(milliseconds(10)); event && *event) seen.push_back(**event);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(std::get<TagPoseFrame>(std::get<Sample>(seen[0])).camera, "rear");
  EXPECT_TRUE(std::holds_alternative<Odometry>(std::get<Sample>(seen[1])));
}

TEST(RobotWithCameras, FailsWithItsCamera) {
  Rig rig;
  rig.camera->broken = true;
  EXPECT_FALSE(rig.both->next(milliseconds(10)));
}

TEST(LiveRobot, AProgramWithoutHelloIsAnError) {
  RobotSetup setup = load_setup("", "", 1).value();
  setup.process = RobotCommand("exit 3");
  const auto gone = LiveRobot::open(setup, {});
  ASSERT_FALSE(gone);
  setup.process = RobotCommand(std::vector<std::string>{"/nowhere/robot"});
  const auto missing = LiveRobot::open(setup, {});
  ASSERT_FALSE(missing);
}

}  // namespace
}  // namespace waymark
