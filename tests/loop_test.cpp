// The whole loop without hardware: a person drives a lap of circuit24, the lap becomes a map and a route, the
// robot drives the route by itself. Judged against the simulator's truth, anchored, without alignment.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "waymark/config/robot_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/anchor_localizer.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/simulation/path.hpp"
#include "waymark/simulation/scripted_driver.hpp"

namespace waymark {
namespace {

constexpr Duration kControlPeriod = std::chrono::milliseconds(50);

const RobotDescription& description() {
  static const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  return robot;
}
const RobotModel& limo() { return description().model; }
const CameraModel& limo_camera() { return description().camera; }

struct Lap {
  std::vector<ObservedFrame> frames;
  TeachSummary summary;
  Trajectory truth;
};

TeachSetup setup_of(const World& world) {
  return {.camera = limo_camera(),
          .base_T_cam = limo().base_T_cam,
          .sizes = {.default_size_m = 0.16},
          .anchor = world.anchor,
          .map_T_anchor = world.tags.find(world.anchor)->map_T_tag};
}

Lap teach(const World& world, std::uint64_t seed) {
  const auto path = sample_path(world.path_m, true, 0.02);
  SimulatedRobot robot(world, limo(), limo_camera(), path[0].map_T_path, {.seed = seed});
  ScriptedDriver driver(path, true, {}, Random(seed + 1000));
  Teacher teacher(setup_of(world));
  Lap lap;
  SensorTime next_command{};
  while (!driver.done() && to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = *robot.next().value();
    if (const auto* frame = std::get_if<TagFrame>(&sample))
      lap.frames.push_back(teacher.add(*frame).observed);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher.add(*odometry);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      lap.truth.push_back({truth->stamp, truth->map_T_base});
    if (robot.now() >= next_command) {
      EXPECT_TRUE(robot.command(driver.drive(robot.true_map_T_base(), robot.now())));
      next_command += kControlPeriod;
    }
  }
  lap.summary = teacher.summary();
  return lap;
}

double tag_rmse_m(const TagMap& estimated, const TagMap& truth) {
  double sum = 0;
  for (const auto& [id, tag] : estimated.tags) {
    sum += (tag.map_T_tag.translation() - truth.find(id)->map_T_tag.translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(estimated.tags.size()));
}

class Loop : public ::testing::TestWithParam<std::uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Loop, ::testing::Range<std::uint64_t>(1, 21));

TEST_P(Loop, ALapIsTaughtAndMapped) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  const Lap lap = teach(*world, GetParam());
  EXPECT_TRUE(lap.summary.closed_loop);
  EXPECT_TRUE(lap.summary.mappable);
  EXPECT_GE(lap.summary.two_tags_fraction(), 0.98);
  EXPECT_NEAR(lap.summary.distance_m, 17.4 * 1.02, 1.0);

  const TeachSetup setup = setup_of(*world);
  const auto map = map_by_chain(lap.frames, setup.anchor, setup.map_T_anchor, setup.sizes, setup.base_T_cam);
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->map.tags.size(), 24U);
  EXPECT_TRUE(map->unconnected.empty());

  std::printf("seed %2d: tags of the chain %.3f m RMSE\n", static_cast<int>(GetParam()),
              tag_rmse_m(map->map, world->tags));
}

// With the true map: where the nearest tag and odometry say the robot is, along a whole lap.
TEST_P(Loop, TheAnchorMethodKnowsWhereTheRobotIs) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  const auto path = sample_path(world->path_m, true, 0.02);
  SimulatedRobot robot(*world, limo(), limo_camera(), path[0].map_T_path, {.seed = GetParam()});
  ScriptedDriver driver(path, true, {}, Random(GetParam() + 1000));
  AnchorLocalizer localizer(world->tags, limo_camera(), limo().base_T_cam);
  std::vector<double> errors;
  SensorTime next_command{};
  while (!driver.done() && to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = *robot.next().value();
    if (const auto* frame = std::get_if<TagFrame>(&sample)) localizer.add(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) {
      localizer.add(*odometry);
      const auto estimate = localizer.estimate();
      if (estimate)
        errors.push_back((estimate->map_T_base.translation() - robot.true_map_T_base().translation()).norm());
    }
    if (robot.now() >= next_command) {
      EXPECT_TRUE(robot.command(driver.drive(robot.true_map_T_base(), robot.now())));
      next_command += kControlPeriod;
    }
  }
  ASSERT_GT(errors.size(), 1000U);
  std::ranges::sort(errors);
  std::printf("seed %2d: anchor method, position error median %.3f m, 95 %% %.3f m, worst %.3f m\n",
              static_cast<int>(GetParam()), errors[errors.size() / 2], errors[errors.size() * 95 / 100],
              errors.back());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
}

Route straight_route() {
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i) trajectory.push_back({SensorTime(Duration(i)), lift(SE2(0.05 * i, 0, 0))});
  return build_route(trajectory).value();
}

/// A method that says what it is told.
class Told final : public LocalizationMethod {
 public:
  explicit Told(const SE2& map_T_base) : map_T_base_(map_T_base) {}
  void add(const TagFrame&) override {}
  void add(const Odometry&) override {}
  std::optional<LocalizationEstimate> estimate() const override {
    return LocalizationEstimate{.stamp = {}, .map_T_base = map_T_base_};
  }

 private:
  SE2 map_T_base_;
};

TEST(Replayer, DrivesRefusesAndStopsWithWords) {
  const auto at = [](double seconds) {
    return SensorTime(Duration(static_cast<std::int64_t>(seconds * 1e9)));
  };
  Replayer good(std::make_unique<Told>(SE2(1, 0, 0)), straight_route(), {}, limo(), {});
  good.add(Odometry{.stamp = at(1.0)});
  EXPECT_GT(good.step(at(1.01)).command.speed_m_s, 0);
  const ReplayStep stale = good.step(at(1.5));
  EXPECT_EQ(stale.state, ReplayState::Stopped);
  EXPECT_EQ(stale.command, VelocityCommand{});
  EXPECT_EQ(stale.reason, "odometry is 0.50 s old (limit 0.30 s)");
  good.add(Odometry{.stamp = at(1.55)});
  EXPECT_EQ(good.step(at(1.56)).state, ReplayState::Driving) << "goes on when the reason is gone";

  Replayer far(std::make_unique<Told>(SE2(1, 2, 0)), straight_route(), {}, limo(), {});
  far.add(Odometry{.stamp = at(1.0)});
  const ReplayStep refused = far.step(at(1.01));
  EXPECT_EQ(refused.state, ReplayState::Refused);
  EXPECT_EQ(refused.command, VelocityCommand{});
  EXPECT_EQ(refused.reason, "the robot is 2.00 m to the left of the route: put it within 0.50 m");

  Replayer end(std::make_unique<Told>(SE2(4.999, 0, 0)), straight_route(), {}, limo(), {});
  end.add(Odometry{.stamp = at(1.0)});
  EXPECT_EQ(end.step(at(1.01)).state, ReplayState::Finished);
}

TEST(Loop, TheSameSeedGivesTheSameBytes) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world);
  const Lap a = teach(*world, 3);
  const Lap b = teach(*world, 3);
  ASSERT_EQ(a.truth.size(), b.truth.size());
  EXPECT_EQ(a.truth.back().map_T_base, b.truth.back().map_T_base);
  ASSERT_EQ(a.frames.size(), b.frames.size());
  EXPECT_EQ(a.frames.back().tags.back().cam_T_tag, b.frames.back().tags.back().cam_T_tag);
}

}  // namespace
}  // namespace waymark
