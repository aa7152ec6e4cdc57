// Where am I, from rendered pictures: motion blur, noise, a real detector.
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/config/robot_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {
namespace {

/// The map is exact, and so is what is known of the camera: what is left to doubt are corners and motion.
TEST(LocalizationInPictures, OfCircuit24IsWithinACentimetre) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  SimulatedStage stage{.world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value(),
                       .model = robot.model,
                       .camera = robot.camera,
                       .robot = robot.simulation};
  stage.robot.seed = 5;
  stage.robot.camera_rate_hz = full ? 15 : 5;
  stage.pictures = SceneEyeOptions{};
  RiekfOptions options;
  options.rotation = "odometry";
  options.tag_sigma_m = options.tag_sigma_rad = options.mounting_sigma_m = options.mounting_sigma_rad = 0;
  RiekfLocalizer filter(Landmarks(stage.world.tags), {stage.camera, stage.model.base_T_cam}, options);

  double squared_m2 = 0;
  double nees = 0;
  int count = 0;
  int uncertain = 0;
  TruthPose truth;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) -> Status {
    if (const auto* said = std::get_if<TruthPose>(&sample)) truth = *said;
    if (const auto* frame = std::get_if<TagFrame>(&sample)) filter.add(*frame);
    const auto* odometry = std::get_if<Odometry>(&sample);
    if (odometry == nullptr) return {};
    filter.add(*odometry);
    filter.clear_news();
    const auto estimate = filter.estimate();
    if (!estimate || estimate->stamp != truth.stamp || odometry->stamp != truth.stamp) return {};
    if (!estimate->certain) {
      uncertain += count > 0 ? 1 : 0;
      return {};
    }
    const SE2 true_T = project_to_plane(truth.map_T_base);
    const Eigen::Vector3d e(estimate->map_T_base.x() - true_T.x(), estimate->map_T_base.y() - true_T.y(),
                            (true_T.inverse() * estimate->map_T_base).yaw());
    squared_m2 += e.head<2>().squaredNorm();
    nees += e.dot(estimate->covariance.inverse() * e);
    ++count;
    return {};
  };
  const auto end = drive_scripted_lap(stage, {}, listener, full ? 60 : 4);
  ASSERT_TRUE(end) << to_string(end.error());
  ASSERT_GT(count, 50);
  const double rmse_m = std::sqrt(squared_m2 / count);
  std::printf("rendered circuit24: rmse %.2f mm, NEES %.2f of 3\n", 1e3 * rmse_m, nees / count);
  EXPECT_LE(rmse_m, 0.010);
  EXPECT_LE(nees / count, 4.5);
  if (full) {  // a few seconds hold few errors that differ
    EXPECT_GE(nees / count, 2);
  }
  EXPECT_EQ(uncertain, 0);
}

}  // namespace
}  // namespace waymark
