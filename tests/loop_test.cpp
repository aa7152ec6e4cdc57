// The whole loop without hardware: a person drives a lap of circuit24, the lap becomes a map and a route, the
// robot drives the route by itself. Judged against the simulator's truth, anchored, without alignment.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

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

RobotModel limo() {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {.name = "limo",
          .hull = {.front_m = 0.161, .rear_m = 0.161, .width_m = 0.22, .height_m = 0.251},
          .limits = {.speed_m_s = 1.0,
                     .yaw_rate_rad_s = 2.0,
                     .acceleration_m_s2 = 2.0,
                     .yaw_acceleration_rad_s2 = 8.0},
          .wheel_radius_m = 0.045,
          .track_m = 0.172,
          .base_T_cam = SE3(SO3::from_matrix(optical), {0.084, 0, 0.18})};
}

CameraModel limo_camera() {
  return CameraModel::make(
             PinholeRadtan{
                 .fx = 442.17, .fy = 443.88, .cx = 323.5, .cy = 247, .k = {0.045, -0.077}, .coefficients = 4},
             640, 480)
      .value();
}

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

struct ReplayResult {
  ReplayState state = ReplayState::Waiting;
  double cross_track_rmse_m = 0;
  double cross_track_max_m = 0;
  int stops = 0;
  std::string reason;
};

/// Drives the route from its start; cross-track is the true path of the replay against the true path of the
/// teach lap.
ReplayResult replay(const World& world, const ChainResult& map, const Route& route, const Route& taught,
                    std::uint64_t seed) {
  SimulatedRobot robot(world, limo(), limo_camera(), taught.points[0].map_T_base, {.seed = seed});
  Replayer replayer(std::make_unique<AnchorLocalizer>(map.map, limo_camera(), limo().base_T_cam), route,
                    map.map, limo(), {});
  ReplayResult result;
  SensorTime next_command{};
  std::vector<double> errors;
  while (to_seconds(robot.now().time_since_epoch()) < 200) {
    const Sample sample = *robot.next().value();
    if (const auto* frame = std::get_if<TagFrame>(&sample)) replayer.add(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) replayer.add(*odometry);
    if (robot.now() < next_command) continue;
    next_command += kControlPeriod;
    const ReplayStep step = replayer.step(robot.now());
    EXPECT_TRUE(robot.command(step.command));
    result.state = step.state;
    if (step.reason) result.reason = *step.reason;
    if (step.state == ReplayState::Finished || step.state == ReplayState::Refused) break;
    if (step.state == ReplayState::Driving)
      errors.push_back(locate(taught, robot.true_map_T_base()).cross_track_m);
  }
  for (const double error : errors) {
    result.cross_track_rmse_m += error * error / static_cast<double>(errors.size());
    result.cross_track_max_m = std::max(result.cross_track_max_m, std::abs(error));
  }
  result.cross_track_rmse_m = std::sqrt(result.cross_track_rmse_m);
  result.stops = replayer.stops();
  return result;
}

class Loop : public ::testing::TestWithParam<std::uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Loop, ::testing::Range<std::uint64_t>(1, 21));

TEST_P(Loop, TaughtMappedAndDrivenAgain) {
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
  const auto route = build_route(map->trajectory);
  const auto taught = build_route(lap.truth);
  ASSERT_TRUE(route && taught);
  EXPECT_TRUE(route->closed);

  const ReplayResult result = replay(*world, *map, *route, *taught, GetParam() + 50);
  RecordProperty("tag_rmse_m", std::to_string(tag_rmse_m(map->map, world->tags)));
  std::printf("seed %2d: tags %.3f m RMSE, replay cross-track %.3f RMSE %.3f max, %d stops\n",
              static_cast<int>(GetParam()), tag_rmse_m(map->map, world->tags), result.cross_track_rmse_m,
              result.cross_track_max_m, result.stops);
  EXPECT_EQ(result.state, ReplayState::Finished) << result.reason;
  EXPECT_EQ(result.stops, 0) << result.reason;
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
