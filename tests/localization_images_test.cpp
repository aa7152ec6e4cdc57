// Localisation from rendered images with blur and noise, through the detector, in the map of their world.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/circuit_lap.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {
namespace {

struct Figures {
  double squared_m2 = 0;
  double nees = 0;
  int count = 0;
  int uncertain = 0;

  void add(const LocalizationEstimate& estimate, const SE2& truth) {
    const Eigen::Vector3d e(estimate.map_T_base.x() - truth.x(), estimate.map_T_base.y() - truth.y(),
                            (truth.inverse() * estimate.map_T_base).yaw());
    squared_m2 += e.head<2>().squaredNorm();
    nees += e.dot(estimate.covariance.inverse() * e);
    uncertain += estimate.certain ? 0 : 1;
    ++count;
  }
};

/// A lap with five images per second, mapped, and localised in that map, like a taught robot.
void drive_and_localize(std::uint64_t seed, Figures& figures) {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const World& world = test::circuit();
  SimulatedSetup setup{.world = world,
                       .model = robot.model,
                       .camera = robot.camera,
                       .robot = robot.simulation,
                       .images = DetectingCameraOptions{}};
  setup.robot.seed = seed;
  setup.robot.camera_rate_hz = 5;
  std::vector<Sample> samples;
  Trajectory truth;
  LapInput lap{.camera = robot.camera,
               .base_T_cam = robot.model.base_T_cam,
               .sizes = {.default_size_m = 0.16},
               .anchor = world.anchor,
               .map_T_anchor = world.tags.find(world.anchor)->map_T_tag};
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (const auto* pose = std::get_if<TruthPose>(&sample)) truth.push_back({pose->stamp, pose->map_T_base});
    if (const auto* tags = std::get_if<TagFrame>(&sample)) lap.frames.push_back(*tags);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.odometry.push_back(*odometry);
    samples.push_back(sample);
    return Status();
  };
  const auto end = drive_scripted_lap(setup, {}, listener);
  ASSERT_TRUE(end) << to_string(end.error());
  RiekfLocalizer filter(Landmarks(test::map_of(lap).map), {robot.camera, robot.model.base_T_cam});
  std::vector<LocalizationEstimate> estimates;
  for (const Sample& sample : samples) {
    if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) filter.add(*imu);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) {
      filter.add(*odometry);
      if (const auto estimate = filter.estimate()) estimates.push_back(*estimate);
    }
  }
  for (const LocalizationEstimate& estimate : estimates)
    if (const auto there = pose_at(truth, estimate.stamp, std::chrono::milliseconds(100)))
      figures.add(estimate, project_to_plane(*there));
}

/// Errors within one lap are correlated, so NEES is over three laps. It is below 3, because the filter allows
/// for errors of prints and lenses that these images do not have. (AprilTag 3 as the detector gives about the
/// same.)
TEST(LocalizationInImages, OnCircuit24IsWithinACentimetreAndConsistent) {
  Figures figures;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) drive_and_localize(seed, figures);
  const double rmse_m = std::sqrt(figures.squared_m2 / figures.count);
  const double nees = figures.nees / figures.count;
  std::printf("%d estimates, %d of them uncertain: rmse %.2f mm, NEES %.2f of 3\n", figures.count,
              figures.uncertain, 1e3 * rmse_m, nees);
  EXPECT_GT(figures.count, 2000);
  EXPECT_LE(rmse_m, 0.010);
  EXPECT_LE(nees, 4.5) << "overconfident";
  EXPECT_GE(nees, 0.7) << "much too conservative";
  EXPECT_LT(figures.uncertain, figures.count / 20);
}

}  // namespace
}  // namespace waymark
