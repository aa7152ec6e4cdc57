// Tests how a simulated robot keeps real time on a slow computer, and how another simulation is used behind a
// wire; that simulation is this program.
#include "waymark/app/robot/plant.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlantPaceTest : public ::testing::Test {
 protected:
  Duration now_ = seconds(1000);
  std::vector<std::string> notes_{};
  PlantPace pace_{[this] { return now_; }, seconds(2),
                  [this](const std::string& words) { notes_.push_back(words); }};
};

TEST_F(PlantPaceTest, WaitsUntilTheClockReachesTheUptime) {
  EXPECT_EQ(pace_.ahead(seconds(2)), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(3)), seconds(1));
  now_ += milliseconds(600);
  EXPECT_EQ(pace_.ahead(seconds(3)), milliseconds(400));
}

TEST_F(PlantPaceTest, CatchesUpShortDelays) {
  now_ += milliseconds(90);
  pace_.leave_out(seconds(2));
  EXPECT_EQ(pace_.left_out(), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(100)), milliseconds(10));
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(PlantPaceTest, SkipsLongDelays) {
  now_ += milliseconds(1600);
  pace_.leave_out(seconds(2));
  EXPECT_EQ(pace_.left_out(), milliseconds(1500));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(100)), Duration(0));
  EXPECT_EQ(pace_.ahead(seconds(2) + milliseconds(150)), milliseconds(50));
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("paused for 1.50 s")));
}

TEST_F(PlantPaceTest, NotesSkippedTimeEveryTenSeconds) {
  Duration uptime = seconds(2);
  for (int i = 0; i < 300; ++i) {  // 30 s at half of real time
    now_ += milliseconds(100);
    uptime += milliseconds(50);
    pace_.leave_out(uptime);
  }
  EXPECT_EQ(pace_.left_out(), seconds(15) - milliseconds(100));
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("0.05 s"), HasSubstr("5.00 s"), HasSubstr("5.00 s")));
}

using ::testing::HasSubstr;

const char* const kOther = "exec '" WAYMARK_PROGRAM "' robot-sim --world circuit24 --seed 4 --lockstep";

/// The odometry of the plant at this uptime.
Odometry odometry_after(Plant& plant, Duration uptime) {
  Odometry newest;
  while (plant.uptime() < uptime) {
    const auto sample = plant.next();
    EXPECT_TRUE(sample) << to_string(sample.error());
    if (!sample) break;
    EXPECT_LE(stamp_of(*sample), plant.now());
    EXPECT_GE(stamp_of(*sample).time_since_epoch(), -std::chrono::milliseconds(200));
    if (const auto* odometry = std::get_if<Odometry>(&*sample)) newest = *odometry;
  }
  return newest;
}

TEST(ProcessPlant, ObeysAndStopsWhenCommandsCease) {
  const auto plant = start_process_plant(kOther, {.watchdog_s = 0.3});
  ASSERT_TRUE(plant) << to_string(plant.error());
  (void)odometry_after(**plant, std::chrono::milliseconds(100));
  ASSERT_TRUE((*plant)->command({0.4, 0}));
  const Odometry drives = odometry_after(**plant, std::chrono::milliseconds(350));
  EXPECT_GT(drives.speed_m_s, 0.2);
  const Odometry stopped = odometry_after(**plant, std::chrono::milliseconds(1200));
  EXPECT_NEAR(stopped.speed_m_s, 0, 0.02) << "no command for more than 0.3 s";
  EXPECT_GT(stopped.odom_T_base.x(), drives.odom_T_base.x());
}

TEST(ProcessPlant, BehavesLikeTheRobotWithoutAProcess) {
  const auto other = start_process_plant(kOther, {});
  ASSERT_TRUE(other) << to_string(other.error());
  const auto setup = load_setup("circuit24", "", 4);
  ASSERT_TRUE(setup);
  const auto& path = setup->simulated.world.path_m;
  const auto along = path[1] - path[0];
  const auto own =
      make_simulated_plant(setup->simulated, {path[0].x(), path[0].y(), std::atan2(along.y(), along.x())});
  ASSERT_TRUE(own) << to_string(own.error());
  const auto driven = [](Plant& plant) {
    Odometry newest;
    for (Duration until = std::chrono::milliseconds(50); until < std::chrono::seconds(1);
         until += std::chrono::milliseconds(100)) {
      newest = odometry_after(plant, until);
      EXPECT_TRUE(plant.command({0.4, 0.2}));
    }
    return newest;
  };
  const Odometry a = driven(**other);
  const Odometry b = driven(**own);
  EXPECT_NEAR(a.odom_T_base.x(), b.odom_T_base.x(), 0.4 * 0.06) << "within one lockstep period, 50 ms";
  EXPECT_NEAR(a.speed_m_s, b.speed_m_s, 0.02);
  EXPECT_NEAR(a.speed_m_s, 0.4, 0.05);
}

TEST(ProcessPlant, ReportsMissingLinesAndAnEndedProcess) {
  const auto incomplete = start_process_plant(kOther, {.sends = {"odometry", "image"}});
  ASSERT_FALSE(incomplete);
  EXPECT_THAT(to_string(incomplete.error()), HasSubstr("'image'"));
  EXPECT_THAT(to_string(start_process_plant("exit 3", {}).error()), HasSubstr("exit code 3"));
  const auto short_one = start_process_plant(
      R"(echo '{"type":"hello","protocol_version":1,"name":"x"}'; echo '{"type":"odometry","stamp_s":5,"x_m":0,"y_m":0,"yaw_rad":0,"speed_m_s":0,"yaw_rate_rad_s":0}')",
      {});
  ASSERT_TRUE(short_one) << to_string(short_one.error());
  const auto first = (*short_one)->next();
  ASSERT_TRUE(first) << to_string(first.error());
  EXPECT_EQ(stamp_of(*first), SensorTime()) << "time begins with its first sample";
  EXPECT_FALSE((*short_one)->next());
}

}  // namespace
}  // namespace waymark
