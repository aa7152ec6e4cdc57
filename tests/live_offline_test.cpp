// Corners of images recorded live equal those found later in the recording, bit for bit.
#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

/// A robot drives forwards for a while, and the samples of the loop are recorded.
void record(const RobotDescription& description, double seconds, const std::filesystem::path& path) {
  const World world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value();
  std::vector<MountedCamera> cameras = {
      {description.camera_name, description.camera, description.model.base_T_cam}};
  cameras.insert(cameras.end(), description.more_cameras.begin(), description.more_cameras.end());
  const SE2 start = sample_path(world.path_m, world.path_closed, 0.02).front().map_T_path;
  SimulatedRobot robot(world, description.model, cameras, start, {.seed = 4}, CameraOutput::Shots);
  SimulatedSource source(robot,
                         DetectingCamera::make(std::make_shared<const World>(world), cameras, {}).value());
  const TagFinder finder = make_tag_finder().value();
  SampleRecorder recorder = SampleRecorder::open(create_file(path).value()).value();
  recorder.add_cameras_with_first_sample(cameras);
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) { return recorder.add(sample); };
  listener.decide = [](Duration, SensorTime) -> Result<DriverDecision> {
    return DriverDecision{.command = {0.3, 0.2}};
  };
  RobotLoop loop(source, robot, lockstep_time([&robot] { return robot.uptime(); }),
                 {.finder = &finder, .cameras = cameras}, {.timeout_s = seconds});
  ASSERT_TRUE(loop.drive(listener));
  ASSERT_TRUE(recorder.close());
}

class LiveOffline : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { std::filesystem::remove(path_); }
  void TearDown() override { std::filesystem::remove(path_); }
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("waymark_live_offline_" + std::string(GetParam()) + ".mcap");
};

TEST_P(LiveOffline, CornersAreIdentical) {
  const std::string file = std::string(WAYMARK_SHARE "/robots/") + GetParam() + ".yaml";
  record(read_robot(file).value(), 1.5, path_);
  const Result<RecordedLap> live = read_lap_file(path_.string());
  const TagFinder finder = make_tag_finder().value();
  const Result<RecordedLap> offline = read_lap_file(path_.string(), {}, &finder);
  ASSERT_TRUE(live) << to_string(live.error());
  ASSERT_TRUE(offline) << to_string(offline.error());
  ASSERT_EQ(live->frames.size(), offline->frames.size());
  int corners = 0;
  for (std::size_t i = 0; i < live->frames.size(); ++i) {
    const TagFrame& a = live->frames[i];
    const TagFrame& b = offline->frames[i];
    ASSERT_EQ(a.stamp, b.stamp);
    ASSERT_EQ(a.camera, b.camera);
    ASSERT_EQ(a.detections.size(), b.detections.size()) << "image " << i;
    for (std::size_t d = 0; d < a.detections.size(); ++d) {
      EXPECT_EQ(a.detections[d].tag, b.detections[d].tag);
      EXPECT_EQ(a.detections[d].corners_px, b.detections[d].corners_px) << "image " << i;
      EXPECT_EQ(a.detections[d].corner_covariance_px2, b.detections[d].corner_covariance_px2);
      corners += 4;
    }
  }
  EXPECT_GT(corners, 100);
}

INSTANTIATE_TEST_SUITE_P(Robots, LiveOffline, ::testing::Values("limo", "limo-front-rear"),
                         [](const auto& robot) {
                           std::string name = robot.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace waymark
