// Tests laps with rendered images: the samples must not depend on the number of threads, and detections must
// agree with the ground truth.
#include "waymark/robots/simulated/simulated_lap.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/localization/anchor_localizer.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

/// A path of two metres straight ahead, towards two tags.
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

TEST(SimulatedLap, TheScriptedDriverStopsAtTheEnd) {
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
  EXPECT_EQ(last->command, VelocityCommand{}) << "stopped at the end";
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

TEST(SimulatedLap, RejectsAWorldWithoutALine) {
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

TEST(SimulatedLap, AReplayWithoutMappedTagsGivesUp) {
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
  EXPECT_LT(reached_m, 0.01) << "a robot that has no pose estimate does not move";
}

/// A short path past four tags, with small images to save time.
SimulatedSetup some_setup(int threads) {
  World world{.name = "line", .path_m = {{0, 0}, {0.3, 0}, {0.6, 0.02}}, .path_closed = false};
  for (const int i : {0, 1, 2, 3})
    world.tags.tags[{FamilyId::Tag36h11, i}] = {
        .map_T_tag = upright_tag({2.0, 0.45 - 0.3 * i, 0.3}, std::numbers::pi), .size_m = 0.16};
  world.anchor = {FamilyId::Tag36h11, 0};
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {.world = world,
          .model = {.limits = {.speed_m_s = 1,
                               .yaw_rate_rad_s = 2,
                               .acceleration_m_s2 = 2,
                               .yaw_acceleration_rad_s2 = 8},
                    .wheel_radius_m = 0.05,
                    .track_m = 0.2,
                    .base_T_cam = SE3(SO3::from_matrix(optical), {0.1, 0, 0.2})},
          .camera =
              CameraModel::make(
                  PinholeRadtan{.fx = 300, .fy = 300, .cx = 160, .cy = 120, .k = {-0.05}, .coefficients = 4},
                  320, 240)
                  .value(),
          .robot = {.camera_rate_hz = 10},
          .images = DetectingCameraOptions{},
          .threads = threads};
}

struct Received {
  std::vector<Sample> samples;
  std::vector<SeenImage> images;
};

Received drive(const SimulatedSetup& setup) {
  Received received;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    received.samples.push_back(sample);
    return {};
  };
  listener.on_image = [&](const SeenImage& seen) -> Status {
    received.images.push_back(seen);
    return {};
  };
  const auto end = drive_scripted_lap(setup, {}, listener);
  EXPECT_TRUE(end && end->finished);
  return received;
}

const TagFrame* frame_of(const Sample& sample) { return std::get_if<TagFrame>(&sample); }

TEST(ImagesByThreads, DoNotDependOnTheNumberOfThreads) {
  const Received one = drive(some_setup(1));
  ASSERT_GT(one.images.size(), 15U);
  for (const int threads : {2, 5}) {
    const Received more = drive(some_setup(threads));
    ASSERT_EQ(one.samples.size(), more.samples.size());
    for (std::size_t i = 0; i < one.samples.size(); ++i) {
      ASSERT_EQ(one.samples[i].index(), more.samples[i].index()) << "in the same order";
      ASSERT_EQ(stamp_of(one.samples[i]), stamp_of(more.samples[i]));
      const TagFrame* a = frame_of(one.samples[i]);
      if (a == nullptr) continue;
      const TagFrame& b = *frame_of(more.samples[i]);
      ASSERT_EQ(a->detections.size(), b.detections.size());
      for (std::size_t k = 0; k < a->detections.size(); ++k)
        EXPECT_EQ(a->detections[k].corners_px, b.detections[k].corners_px);
    }
    ASSERT_EQ(one.images.size(), more.images.size());
    for (std::size_t i = 0; i < one.images.size(); ++i)
      EXPECT_EQ(one.images[i].frame.image, more.images[i].frame.image) << i;
  }
}

TEST(Images, DetectionsAgreeWithTheGroundTruth) {
  int found = 0;
  int there = 0;
  double worst = 0;
  for (const SeenImage& seen : drive(some_setup(1)).images) {
    for (const SceneTagTruth& truth : seen.frame.tags) {
      if (std::ranges::count(truth.corner_visible, true) < 4) continue;
      ++there;
      const auto detection = std::ranges::find(seen.found.detections, truth.tag, &TagDetection::tag);
      if (detection == seen.found.detections.end()) continue;
      ++found;
      for (std::size_t k = 0; k < 4; ++k)
        worst = std::max(worst, (detection->corners_px[k] - truth.corners_px[k]).norm());
    }
  }
  ASSERT_GT(there, 40);
  EXPECT_GT(found, 0.95 * there);
  EXPECT_LT(worst, 1.0) << "px";
}

TEST(Images, OfACoveredLensAreDark) {
  SimulatedSetup setup = some_setup(2);
  setup.robot.faults = {{.kind = FaultKind::CameraBlackout, .at_s = 0.5, .for_s = 0.5},
                        {.kind = FaultKind::TagRemoved, .at_s = 1.5, .tag = {FamilyId::Tag36h11, 1}}};
  int dark = 0;
  for (const SeenImage& seen : drive(setup).images) {
    const double now_s = to_seconds(seen.found.stamp.time_since_epoch());
    const bool covered = now_s >= 0.5 && now_s < 1.0;
    dark += covered ? 1 : 0;
    EXPECT_EQ(seen.found.detections.empty(), covered) << now_s;
    const bool second =
        std::ranges::count(seen.found.detections, TagId{FamilyId::Tag36h11, 1}, &TagDetection::tag) > 0;
    EXPECT_TRUE(covered || second == (now_s < 1.5)) << now_s;
  }
  EXPECT_EQ(dark, 5);
}

TEST(ImagesByThreads, StopWhileImagesArePending) {
  SimulatedSetup setup = some_setup(4);
  int samples = 0;
  LapListener listener;
  listener.on_sample = [&](const Sample&) -> Status {
    if (++samples > 300) return fail(ErrorCode::Unwritable, "disk full");
    return {};
  };
  EXPECT_FALSE(drive_scripted_lap(setup, {}, listener));
}

}  // namespace
}  // namespace waymark
