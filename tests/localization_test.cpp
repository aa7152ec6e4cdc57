// Where am I, judged: by the truth in simulation (consistent, efficient, hard to lose), by tape and motion
// capture on two real logs.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/data.hpp"
#include "waymark/config/landmarks_file.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/innovation_calibration.hpp"
#include "waymark/localization/smoother.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/simulation/path.hpp"
#include "waymark/simulation/scripted_driver.hpp"

namespace waymark {
namespace {

bool full() { return std::getenv("WAYMARK_FULL") != nullptr; }

/// A lap as its robot would log it, and where it really was.
struct Drive {
  std::vector<Sample> samples{};
  std::vector<TruthPose> truth{};

  [[nodiscard]] std::optional<SE2> at(SensorTime stamp) const {
    const auto next = std::ranges::lower_bound(truth, stamp, {}, &TruthPose::stamp);
    if (next == truth.begin() || next == truth.end()) return std::nullopt;
    const TruthPose& a = *(next - 1);
    const double u = to_seconds(stamp - a.stamp) / to_seconds(next->stamp - a.stamp);
    return interpolate(project_to_plane(a.map_T_base), project_to_plane(next->map_T_base), u);
  }
};

RobotDescription robot_named(const std::string& name) {
  return read_robot(std::string(WAYMARK_SHARE "/robots/") + name + ".yaml").value();
}
World world_named(const std::string& name) {
  return read_world(std::string(WAYMARK_SHARE "/worlds/") + name + ".yaml").value();
}

Drive drive(const World& world, const RobotDescription& robot, std::uint64_t seed, double seconds) {
  const auto path = sample_path(world.path_m, world.path_closed, 0.02);
  SimulatedRobotOptions options = robot.simulation;
  options.seed = seed;
  options.lidar.rays = 1;
  SimulatedRobot simulated(world, robot.model, robot.camera, path[0].map_T_path, options);
  ScriptedDriver driver(path, world.path_closed, {.speed_m_s = 0.25}, Random(seed + 1000));
  Drive drive;
  SensorTime next_command{};
  const SensorTime start = simulated.now();
  while (!driver.done() && to_seconds(simulated.now() - start) < seconds) {
    Sample sample = *simulated.next().value();
    if (const auto* truth = std::get_if<TruthPose>(&sample)) drive.truth.push_back(*truth);
    drive.samples.push_back(std::move(sample));
    if (simulated.now() < next_command) continue;
    EXPECT_TRUE(simulated.command(driver.drive(simulated.true_map_T_base(), SensorTime(simulated.uptime()))));
    next_command = simulated.now() + std::chrono::milliseconds(50);
  }
  return drive;
}

/// What the simulator does to motion, as the filter is told of it.
RiekfOptions filter_for(const RobotDescription& robot) {
  RiekfOptions options;
  options.rotation = "odometry";
  options.tag_sigma_m = options.tag_sigma_rad = options.mounting_sigma_m = options.mounting_sigma_rad = 0;
  const MotionSensorOptions& sensors = robot.simulation.sensors;
  MotionNoise& noise = options.motion;
  if (sensors.odometry == "truth") {  // a random walk, whatever the robot does
    const double rate = std::sqrt(robot.simulation.odometry_rate_hz);
    noise = {.along_m_sqrt_m = 0,
             .across_m_sqrt_m = 0,
             .yaw_rad_sqrt_m = 0,
             .yaw_rad_sqrt_rad = 0,
             .yaw_rad_sqrt_s = sensors.odometry_noise_rad * rate,
             .drift_m_sqrt_s = sensors.odometry_noise_m * rate,
             .distance_scale_sigma = 0,
             .yaw_scale_sigma = 0,
             .yaw_bias_sigma_rad_s = 0,
             .slip_sigma_s = 0};
    // Its heading error turns no distance: odometry goes askew by as much as the heading is wrong, a random
    // walk.
    noise.crab_sigma_rad = 0.1;
    noise.slow_time_s = 2 * std::pow(noise.crab_sigma_rad / noise.yaw_rad_sqrt_s, 2);
    return options;
  }
  const double speed = 0.25;
  noise.along_m_sqrt_m = 0.001;
  // Sideways speed that stays for a tenth of a second, seen every fifteenth: between white and constant.
  noise.across_m_sqrt_m = robot.simulation.dynamics.slip_noise_m_s * std::sqrt(0.06 / speed);
  noise.yaw_rad_sqrt_m = 0;
  noise.yaw_rad_sqrt_rad = 0;
  noise.yaw_rad_sqrt_s = sensors.gyro_noise_rad_s / std::sqrt(robot.simulation.odometry_rate_hz);
  noise.drift_m_sqrt_s = 1e-5;
  noise.yaw_scale_sigma = 0;
  return options;
}

struct Figures {
  double squared_m2 = 0;
  double bound_m2 = 0;  ///< what the covariance says
  double nees = 0;
  double nis = 0;
  double nis_rows = 0;
  int count = 0;
  int uncertain = 0;
  std::vector<double> nees_at{};  ///< moment by moment

  [[nodiscard]] double rmse_m() const { return std::sqrt(squared_m2 / count); }
  [[nodiscard]] double sigma_m() const { return std::sqrt(bound_m2 / count); }
};

void score(const LocalizationEstimate& estimate, const SE2& truth, Figures& figures) {
  const Eigen::Vector3d e(estimate.map_T_base.x() - truth.x(), estimate.map_T_base.y() - truth.y(),
                          (truth.inverse() * estimate.map_T_base).yaw());
  figures.squared_m2 += e.head<2>().squaredNorm();
  figures.bound_m2 += estimate.covariance.topLeftCorner<2, 2>().trace();
  figures.nees_at.push_back(e.dot(estimate.covariance.inverse() * e));
  figures.nees += figures.nees_at.back();
  figures.uncertain += estimate.certain ? 0 : 1;
  ++figures.count;
}

/// The filter on a lap; started at the truth, as its covariance says.
Figures run(const Drive& drive, const World& world, const RobotDescription& robot,
            const RiekfOptions& options, ErrorState error = ErrorState::RightInvariant) {
  RiekfLocalizer filter(Landmarks(world.tags), {robot.camera, robot.model.base_T_cam}, options, error);
  Random random(7);
  const SE2 start = project_to_plane(drive.truth.front().map_T_base);
  filter.start_from({start.x() + random.normal(0, 0.02), start.y() + random.normal(0, 0.02),
                     start.yaw() + random.normal(0, 0.02)},
                    0.02, 0.02);
  Figures figures;
  int frames = 0;
  for (const Sample& sample : drive.samples) {
    if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) {
      filter.add(*odometry);
      const auto truth = drive.at(odometry->stamp);
      const auto estimate = filter.estimate();
      // Every half second: errors a moment apart are one error.
      if (truth && estimate && ++frames % 25 == 0) score(*estimate, *truth, figures);
    }
    for (const NisRecord& record : filter.news()) {
      if (record.nis > 1e4) continue;
      figures.nis += record.nis;
      figures.nis_rows += record.rows;
    }
    filter.clear_news();
  }
  return figures;
}

void consistent_and_efficient(const std::string& world_name, const std::string& robot_name) {
  const World world = world_named(world_name);
  const RobotDescription robot = robot_named(robot_name);
  const int seeds = full() ? 50 : 4;
  Figures all;
  std::vector<double> sums;  // over the seeds, moment by moment
  for (int seed = 1; seed <= seeds; ++seed) {
    const Drive lap = drive(world, robot, static_cast<std::uint64_t>(seed), full() ? 60 : 30);
    const Figures one = run(lap, world, robot, filter_for(robot));
    all.squared_m2 += one.squared_m2;
    all.bound_m2 += one.bound_m2;
    all.nees += one.nees;
    all.nis += one.nis;
    all.nis_rows += one.nis_rows;
    all.count += one.count;
    all.uncertain += one.uncertain;
    sums.resize(seed == 1 ? one.nees_at.size() : std::min(sums.size(), one.nees_at.size()), 0);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += one.nees_at[i];
  }
  const double nees = all.nees / all.count;
  const double nis = all.nis / all.nis_rows;
  // Of a mean over the seeds at one moment, chi-square with 3 degrees of freedom each (Bar-Shalom, Li and
  // Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4.2).
  const double width = 1.96 * std::sqrt(6.0 / seeds);
  const auto inside =
      std::ranges::count_if(sums, [&](double sum) { return std::abs(sum / seeds - 3) < width; });
  const double share = static_cast<double>(inside) / static_cast<double>(sums.size());
  std::printf(
      "%s, %d seeds: rmse %.2f mm, bound %.2f mm, NEES %.2f of 3 (%.0f %% of moments in the 95 %% interval), "
      "NIS %.3f "
      "of 1, %d uncertain\n",
      world_name.c_str(), seeds, 1e3 * all.rmse_m(), 1e3 * all.sigma_m(), nees, 100 * share, nis,
      all.uncertain);
  // Four seeds scatter: the figure itself is that of fifty.
  EXPECT_LT(all.rmse_m(), (full() ? 1.15 : 1.4) * all.sigma_m());
  EXPECT_NEAR(nees, 3, width);
  EXPECT_NEAR(nis, 1, 0.07);  // 95 % for four tags and fifty seeds
  EXPECT_EQ(all.uncertain, 0);
  // Sideways slip that stays for a tenth of a second is taken as white: rather too much doubt than too
  // little.
  const auto overconfident = std::ranges::count_if(sums, [&](double sum) { return sum / seeds > 3 + width; });
  EXPECT_LT(static_cast<double>(overconfident), 0.1 * static_cast<double>(sums.size()));
}

TEST(LocalizationInSimulation, Circuit24IsConsistentAndEfficient) {
  consistent_and_efficient("circuit24", "limo");
}
TEST(LocalizationInSimulation, TheAcademysHouseToo) {
  consistent_and_efficient("academy-house", "turtlebot3-waffle");
}

}  // namespace
}  // namespace waymark
