#include "waymark/robots/simulated/simulated_lap.hpp"

#include <gtest/gtest.h>

#include "waymark/localization/anchor_localizer.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

/// Two metres straight ahead, towards two tags.
SimulatedSetup some_setup() {
  World world{.name = "line", .path_m = {{0, 0}, {1, 0}, {2, 0}}, .path_closed = false};
  for (const int side : {-1, 1}) {
    world.tags.tags[{FamilyId::Tag36h11, side + 1}] = {
        .map_T_tag = upright_tag({4, 0.5 * side, 0.3}, 3.14159265 + 0.6 * side), .size_m = 0.16};
  }
  world.anchor = {FamilyId::Tag36h11, 0};
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {.world = world,
          .model = {.name = "box",
                    .hull = {.front_m = 0.1, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.2},
                    .limits = {.speed_m_s = 1,
                               .yaw_rate_rad_s = 2,
                               .acceleration_m_s2 = 2,
                               .yaw_acceleration_rad_s2 = 8},
                    .wheel_radius_m = 0.05,
                    .track_m = 0.2,
                    .base_T_cam = SE3(SO3::from_matrix(optical), {0.1, 0, 0.2})},
          .camera =
              CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value()};
}

Replayer some_replayer(const SimulatedSetup& setup, const TagMap& map) {
  Trajectory line;
  for (int i = 0; i <= 40; ++i)
    line.push_back({SensorTime(Duration(i)), SE3(SO3(), Eigen::Vector3d(0.05 * i, 0, 0))});
  return {std::make_unique<AnchorLocalizer>(map, setup.camera, setup.model.base_T_cam),
          build_route(line).value(),
          map,
          setup.model,
          {}};
}

TEST(SimulatedLap, ADriverDrivesToTheEndAndStands) {
  std::optional<StampedCommand> last;
  double reached_m = 0;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    if (const auto* command = std::get_if<StampedCommand>(&sample)) last = *command;
    if (const auto* truth = std::get_if<TruthPose>(&sample)) reached_m = truth->map_T_base.translation().x();
    return {};
  };
  const auto end = drive_scripted_lap(some_setup(), {}, listener);
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished);
  EXPECT_FALSE(end->interrupted);
  EXPECT_NEAR(reached_m, 2.0, 0.1);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->command, VelocityCommand{}) << "told to stand at the end";
}

TEST(SimulatedLap, TheListenerCanEndIt) {
  int samples = 0;
  VelocityCommand last{1, 1};
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    ++samples;
    if (const auto* command = std::get_if<StampedCommand>(&sample)) last = command->command;
    return {};
  };
  listener.should_stop = [&] { return samples > 100; };
  const auto stopped = drive_scripted_lap(some_setup(), {}, listener);
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(stopped->interrupted);
  EXPECT_FALSE(stopped->finished);
  EXPECT_EQ(last, VelocityCommand{});
  listener.on_sample = [](const Sample&) -> Status { return fail(ErrorCode::Unwritable, "disk full"); };
  const auto failed = drive_scripted_lap(some_setup(), {}, listener);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "disk full");
}

TEST(SimulatedLap, AWorldWithoutALineIsRefused) {
  SimulatedSetup setup = some_setup();
  setup.world.path_m.clear();
  EXPECT_FALSE(drive_scripted_lap(setup, {}, {}));
  Replayer replayer = some_replayer(setup, setup.world.tags);
  EXPECT_FALSE(drive_replay(setup, replayer, {}));
}

TEST(SimulatedLap, AReplayWithTheTrueMapReachesItsGoal) {
  const SimulatedSetup setup = some_setup();
  Replayer replayer = some_replayer(setup, setup.world.tags);
  const auto end = drive_replay(setup, replayer, {});
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->finished) << end->reason;
  EXPECT_EQ(end->state, ReplayState::Finished);
  EXPECT_GT(end->frames_with_two_tags, end->frames / 2);
}

TEST(SimulatedLap, AReplayThatSeesNoTagOfItsMapIsGivenUp) {
  const SimulatedSetup setup = some_setup();
  TagMap elsewhere;
  elsewhere.tags[{FamilyId::Tag36h11, 99}] = {.map_T_tag = SE3(), .size_m = 0.16};
  Replayer replayer = some_replayer(setup, elsewhere);
  double reached_m = 0;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      reached_m = truth->map_T_base.translation().norm();
    return {};
  };
  const auto end = drive_replay(setup, replayer, listener, {.give_up_s = 2});
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->finished);
  EXPECT_EQ(end->state, ReplayState::Waiting);
  EXPECT_NEAR(end->lap_s, 2, 0.1);
  EXPECT_LT(reached_m, 0.01) << "a robot that does not know where it is stands";
}

}  // namespace
}  // namespace waymark
