// The whole loop without hardware: a lap of circuit24 is driven, becomes a map and a route, and the robot
// repeats the route. Errors are against the simulator's ground truth, anchored, without alignment.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/anchor_localizer.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/simulation/robot/scripted_driver.hpp"
#include "waymark/simulation/world/world.hpp"

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
  Teacher watcher(setup_of(world));
  Lap lap;
  SensorTime next_command{};
  while (!driver.done() && to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = robot.next();
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      lap.frames.push_back(teacher.add(*frame).observed);
      watcher.watch(*frame);
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) {
      teacher.add(*odometry);
      watcher.add(*odometry);
    }
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      lap.truth.push_back({truth->stamp, truth->map_T_base});
    if (robot.now() >= next_command) {
      EXPECT_TRUE(robot.command(driver.drive(robot.true_map_T_base(), robot.now())));
      next_command += kControlPeriod;
    }
  }
  lap.summary = teacher.summary();
  const TeachSummary watched = watcher.summary();
  EXPECT_EQ(watched.seen, lap.summary.seen);
  EXPECT_EQ(watched.closed_loop, lap.summary.closed_loop);
  EXPECT_EQ(watched.low_observability_frames, lap.summary.low_observability_frames);
  EXPECT_EQ(watched.warnings, lap.summary.warnings);
  return lap;
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

  const TagMapErrors tags = tag_map_errors(map->map, world->tags);
  const TrajectoryErrors way = trajectory_errors(map->trajectory, lap.truth);
  std::printf(
      "seed %2d: chain: tags %.3f m RMSE, worst %.3f m, %.2f deg; trajectory %.3f m RMSE, worst %.3f m, %.2f "
      "deg\n",
      static_cast<int>(GetParam()), tags.rmse_m, tags.max_m, tags.orientation_rmse_deg, way.rmse_m, way.max_m,
      way.orientation_rmse_deg);
  EXPECT_LT(tags.rmse_m, 0.06);
  EXPECT_LT(tags.max_m, 0.12);
  EXPECT_LT(tags.orientation_rmse_deg, 2);
  EXPECT_LT(way.rmse_m, 0.08);
  EXPECT_EQ(way.poses, map->trajectory.size());
  EXPECT_LT(map->frames_without_pose, 10);
}

struct Repeat {
  ReplayStep last;
  Trajectory truth;
  int stops = 0;
  double two_tags_fraction = 0;
  double worst_sigma_m = 0;
};

/// The robot is placed where the lap began, with the accuracy of a person.
Repeat replay(const World& world, const TagMap& map, const Route& route, const SE2& start,
              std::uint64_t seed) {
  Random random(seed + 3000);
  const SE2 put = start * SE2(0.05 * random.normal(), 0.03 * random.normal(), 0.05 * random.normal());
  SimulatedRobot robot(world, limo(), limo_camera(), put, {.seed = seed + 2000});
  Replayer replayer(std::make_unique<AnchorLocalizer>(map, limo_camera(), limo().base_T_cam), route, map,
                    limo(), {.controller = ReplayController::Pursuit});
  Repeat repeat;
  double frames = 0;
  double frames_with_two = 0;
  SensorTime next_command{};
  const auto over = [&] {
    return repeat.last.state == ReplayState::Finished || repeat.last.state == ReplayState::Refused;
  };
  while (!over() && to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = robot.next();
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      replayer.add(*frame);
      frames += 1;
      frames_with_two += frame->detections.size() >= 2 ? 1 : 0;
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) replayer.add(*odometry);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      repeat.truth.push_back({truth->stamp, truth->map_T_base});
    if (robot.now() < next_command) continue;
    repeat.last = replayer.step(robot.now());
    EXPECT_TRUE(robot.command(repeat.last.command));
    if (repeat.last.estimate)
      repeat.worst_sigma_m = std::max(repeat.worst_sigma_m, repeat.last.estimate->position_sigma_m());
    next_command += kControlPeriod;
  }
  repeat.stops = replayer.stops();
  repeat.two_tags_fraction = frames_with_two / frames;
  return repeat;
}

TEST_P(Loop, TheLapIsRepeated) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  const Lap lap = teach(*world, GetParam());
  const TeachSetup setup = setup_of(*world);
  const auto map = map_by_chain(lap.frames, setup.anchor, setup.map_T_anchor, setup.sizes, setup.base_T_cam);
  ASSERT_TRUE(map) << to_string(map.error());
  const auto route = build_route(map->trajectory);
  ASSERT_TRUE(route) << to_string(route.error());
  EXPECT_TRUE(route->closed);
  const SE2 start = project_to_plane(lap.truth.front().map_T_base);
  const Repeat repeat = replay(*world, map->map, *route, start, GetParam());
  EXPECT_EQ(repeat.last.state, ReplayState::Finished) << repeat.last.reason.value_or("");
  const auto judged = judge_replay(repeat.truth, lap.truth, world->tags, limo().hull);
  ASSERT_TRUE(judged) << to_string(judged.error());
  std::printf(
      "seed %2d: replay: %d lap, cross-track %.3f m RMSE, p95 %.3f m, worst %.3f m; heading %.2f deg; "
      "clearance %.3f m; "
      "two tags %.3f; stops %d; worst sigma %.3f m\n",
      static_cast<int>(GetParam()), judged->laps_completed, judged->cross_track_rmse_m,
      judged->cross_track_p95_m, judged->cross_track_max_m, judged->heading_rmse_deg, judged->min_clearance_m,
      repeat.two_tags_fraction, repeat.stops, repeat.worst_sigma_m);
  EXPECT_EQ(judged->laps_completed, 1);
  EXPECT_NEAR(judged->laps, 1, 0.01);
  EXPECT_LT(judged->cross_track_rmse_m, 0.06);
  EXPECT_LT(judged->cross_track_p95_m, 0.15);
  EXPECT_LT(judged->cross_track_max_m, 0.25);
  EXPECT_LT(judged->heading_rmse_deg, 10);
  EXPECT_GT(judged->min_clearance_m, 0.3);
  EXPECT_GT(repeat.two_tags_fraction, 0.95);
  EXPECT_LE(repeat.stops, 2);
}

// With the true map: poses by the nearest tag and odometry along a whole lap.
TEST_P(Loop, TheAnchorMethodLocalisesTheRobot) {
  const auto world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml");
  ASSERT_TRUE(world) << to_string(world.error());
  const auto path = sample_path(world->path_m, true, 0.02);
  SimulatedRobot robot(*world, limo(), limo_camera(), path[0].map_T_path, {.seed = GetParam()});
  ScriptedDriver driver(path, true, {}, Random(GetParam() + 1000));
  AnchorLocalizer localizer(world->tags, limo_camera(), limo().base_T_cam);
  std::vector<double> errors;
  SensorTime next_command{};
  while (!driver.done() && to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = robot.next();
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
  EXPECT_LT(errors[errors.size() / 2], 0.03);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.10);
  EXPECT_LT(errors.back(), 0.25);
}

Route straight_route() {
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i) trajectory.push_back({SensorTime(Duration(i)), lift(SE2(0.05 * i, 0, 0))});
  return build_route(trajectory).value();
}

/// A method with a fixed estimate.
class FixedEstimate final : public LocalizationMethod {
 public:
  using LocalizationMethod::add;
  explicit FixedEstimate(const SE2& map_T_base) : map_T_base_(map_T_base) {}
  void add(const TagFrame&) override {}
  void add(const Odometry&) override {}
  std::optional<LocalizationEstimate> estimate() const override {
    return LocalizationEstimate{.stamp = {}, .map_T_base = map_T_base_};
  }

 private:
  SE2 map_T_base_;
};

TEST(Replayer, DrivesRefusesAndStopsWithReasons) {
  const auto at = [](double seconds) {
    return SensorTime(Duration(static_cast<std::int64_t>(seconds * 1e9)));
  };
  Replayer good(std::make_unique<FixedEstimate>(SE2(1, 0, 0)), straight_route(), {}, limo(), {});
  good.add(Odometry{.stamp = at(1.0)});
  EXPECT_GT(good.step(at(1.01)).command.speed_m_s, 0);
  EXPECT_EQ(good.step(at(1.25)).state, ReplayState::Driving);
  const ReplayStep stale = good.step(at(1.5));
  EXPECT_EQ(stale.state, ReplayState::Stopped);
  EXPECT_EQ(stale.command, VelocityCommand{});
  EXPECT_THAT(stale.reason.value_or(""),
              ::testing::AllOf(::testing::HasSubstr("0.50 s"), ::testing::HasSubstr("limit 0.30 s")));
  testing::expect_on_page("replay", stale.reason.value_or(""));
  good.add(Odometry{.stamp = at(1.55)});
  EXPECT_EQ(good.step(at(1.56)).state, ReplayState::Driving) << "continues when the reason is gone";

  Replayer far(std::make_unique<FixedEstimate>(SE2(1, 2, 0)), straight_route(), {}, limo(), {});
  far.add(Odometry{.stamp = at(1.0)});
  const ReplayStep refused = far.step(at(1.01));
  EXPECT_EQ(refused.state, ReplayState::Refused);
  EXPECT_EQ(refused.command, VelocityCommand{});
  EXPECT_THAT(refused.reason.value_or(""),
              ::testing::AllOf(::testing::HasSubstr("2.00 m"), ::testing::HasSubstr("0.50 m"),
                               ::testing::HasSubstr("x 1.00 m")));
  testing::expect_on_page("replay", refused.reason.value_or(""));

  // After one second without any sensor sample it stays stopped until it is resumed.
  (void)good.step(at(1.57));
  ReplayStep silent;
  for (int i = 0; i < 30; ++i) silent = good.step(at(1.6 + 0.05 * i));
  EXPECT_TRUE(silent.lasting) << silent.reason.value_or("");
  good.add(Odometry{.stamp = at(3.1)});
  const ReplayStep asks = good.step(at(3.12));
  EXPECT_THAT(asks.reason.value_or(""), ::testing::HasSubstr("1.0 s"));
  testing::expect_on_page("replay", asks.reason.value_or(""));
  good.resume();
  good.add(Odometry{.stamp = at(3.15)});
  EXPECT_EQ(good.step(at(3.16)).state, ReplayState::Driving);

  good.pause("paused by this test");
  const ReplayStep held = good.step(at(3.20));
  EXPECT_EQ(held.reason, "paused by this test");
  EXPECT_TRUE(held.lasting);
  EXPECT_EQ(good.step(at(3.25)).command, VelocityCommand{});
  good.resume();
  good.add(Odometry{.stamp = at(3.29)});
  EXPECT_EQ(good.step(at(3.30)).state, ReplayState::Driving);

  Replayer end(std::make_unique<FixedEstimate>(SE2(4.999, 0, 0)), straight_route(), {}, limo(), {});
  end.add(Odometry{.stamp = at(1.0)});
  const ReplayStep over = end.step(at(1.01));
  EXPECT_EQ(over.state, ReplayState::Incomplete) << "nothing of the route was driven";
  EXPECT_THAT(over.reason.value_or(""), ::testing::HasSubstr("5.00 m"));
  testing::expect_on_page("replay", over.reason.value_or(""));
  EXPECT_EQ(over.command, VelocityCommand{});
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
