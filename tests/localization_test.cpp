// Localisation evaluated against ground truth in simulation (consistent, efficient, robust), and against tape
// and motion capture on two real logs.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/data.hpp"
#include "tests/support/posterior_bound.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/innovation_fits.hpp"
#include "waymark/localization/smoother.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/simulation/robot/scripted_driver.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

bool full() { return std::getenv("WAYMARK_FULL") != nullptr; }

/// A lap as its robot would log it, with the true poses.
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
    Sample sample = simulated.next();
    if (const auto* truth = std::get_if<TruthPose>(&sample)) drive.truth.push_back(*truth);
    drive.samples.push_back(std::move(sample));
    if (simulated.now() < next_command) continue;
    EXPECT_TRUE(simulated.command(driver.drive(simulated.true_map_T_base(), SensorTime(simulated.uptime()))));
    next_command = simulated.now() + std::chrono::milliseconds(50);
  }
  return drive;
}

/// A robot of its kind as configured in the filter; its unknown constants are drawn.
struct OneOfMany {
  RobotDescription robot;
  testing::TrueNoise noise{};
  RiekfOptions options{};
  double askew_rad = 0;  ///< direction of odom relative to the initial heading
};

RiekfOptions exact_map() {
  RiekfOptions options;
  options.rotation = "odometry";
  options.tag_sigma_m = options.tag_sigma_rad = options.mounting_sigma_m = options.mounting_sigma_rad = 0;
  options.motion.slow_time_s = 1e6;  // errors of this robot are constant
  return options;
}

/// The odometry of the Academy's exercise: a random walk, and a heading error that does not rotate the
/// translation.
OneOfMany with_walking_odometry(RobotDescription robot, Random& random) {
  MotionSensorOptions& sensors = robot.simulation.sensors;
  sensors.odometry = "truth";
  sensors.odometry_noise_m = sensors.odometry_noise_rad = 0.001;
  const double rate = std::sqrt(robot.simulation.odometry_rate_hz);
  OneOfMany one{
      .robot = robot,
      .noise = {.gyro_rad = 0.001 * rate, .way_in_odom = true, .askew_rad = 0.1, .walk_m = 0.001 * rate},
      .options = exact_map()};
  one.askew_rad = random.normal(0, one.noise.askew_rad);
  one.options.motion = {.along_m_sqrt_m = 0,
                        .across_m_sqrt_m = 0,
                        .yaw_rad_sqrt_m = 0,
                        .yaw_rad_sqrt_rad = 0,
                        .yaw_rad_sqrt_s = one.noise.gyro_rad,
                        .drift_m_sqrt_s = one.noise.walk_m,
                        .distance_scale_sigma = 0,
                        .yaw_scale_sigma = 0,
                        .yaw_bias_sigma_rad_s = 0,
                        .slip_sigma_s = 0,
                        .crab_sigma_rad = one.noise.askew_rad,
                        .crab_share = 1};
  return one;
}

/// Wheels with an inaccurate radius, a gyro with a bias, lateral slip.
OneOfMany with_wheels_and_gyro(RobotDescription robot, Random& random) {
  MotionSensorOptions& sensors = robot.simulation.sensors;
  DynamicsOptions& dynamics = robot.simulation.dynamics;
  OneOfMany one{
      .robot = robot,
      .noise = {.scale = 0.03,
                .bias_rad_s = 0.005,
                .slip_s = 0.03,
                .slide_m_s = dynamics.slip_noise_m_s,
                .slide_time_s = dynamics.slip_time_s,
                .gyro_rad = sensors.gyro_noise_rad_s / std::sqrt(robot.simulation.odometry_rate_hz)},
      .options = exact_map()};
  sensors.left_wheel_scale = sensors.right_wheel_scale = 1 / (1 + random.normal(0, one.noise.scale));
  sensors.gyro_bias_rad_s = random.normal(0, one.noise.bias_rad_s);
  dynamics.lateral_slip_s = random.normal(0, one.noise.slip_s);
  one.robot = robot;
  MotionNoise& noise = one.options.motion;
  noise.along_m_sqrt_m = 0;  // encoders are quantised, but the error of one step is compensated in the next
  noise.across_m_sqrt_m = 0;
  noise.slide_m_s = one.noise.slide_m_s;
  noise.slide_time_s = one.noise.slide_time_s;
  noise.yaw_rad_sqrt_m = 0;
  noise.yaw_rad_sqrt_rad = 0;
  noise.yaw_rad_sqrt_s = one.noise.gyro_rad;
  noise.drift_m_sqrt_s = 1e-5;
  noise.distance_scale_sigma = one.noise.scale;
  noise.yaw_scale_sigma = 0;
  noise.yaw_bias_sigma_rad_s = one.noise.bias_rad_s;
  noise.slip_sigma_s = one.noise.slip_s;
  return one;
}

/// Sums over the drives at one time.
struct Moment {
  double sum = 0;
  double freedom = 0;  ///< degrees of freedom of the expected chi-square

  void add(double value, double degrees) {
    sum += value;
    freedom += degrees;
  }
  [[nodiscard]] bool inside_95() const { return std::abs(sum - freedom) < 1.96 * std::sqrt(2 * freedom); }
};

struct Figures {
  double squared_m2 = 0;
  double covariance_m2 = 0;  ///< by the filter
  double bound_m2 = 0;       ///< lower bound of any estimator
  int count = 0;
  int uncertain = 0;
  std::vector<Moment> nees{};
  std::vector<Moment> nis{};

  [[nodiscard]] double rmse_m() const { return std::sqrt(squared_m2 / count); }
  [[nodiscard]] double bound_m() const { return std::sqrt(bound_m2 / count); }
};

void add_to(std::vector<Moment>& moments, std::size_t at, double value, double degrees) {
  if (moments.size() <= at) moments.resize(at + 1);
  moments[at].add(value, degrees);
}

double mean_of(const std::vector<Moment>& moments) {
  Moment all;
  for (const Moment& moment : moments) all.add(moment.sum, moment.freedom);
  return all.sum / all.freedom;
}

double share_inside(const std::vector<Moment>& moments) {
  return static_cast<double>(std::ranges::count_if(moments, &Moment::inside_95)) /
         static_cast<double>(moments.size());
}

void score(const LocalizationEstimate& estimate, const SE2& truth, const Eigen::Matrix3d& bound,
           std::size_t moment, Figures& figures) {
  const Eigen::Vector3d e(estimate.map_T_base.x() - truth.x(), estimate.map_T_base.y() - truth.y(),
                          (truth.inverse() * estimate.map_T_base).yaw());
  figures.squared_m2 += e.head<2>().squaredNorm();
  figures.covariance_m2 += estimate.covariance.topLeftCorner<2, 2>().trace();
  figures.bound_m2 += bound.topLeftCorner<2, 2>().trace();
  add_to(figures.nees, moment, e.dot(estimate.covariance.inverse() * e), 3);
  figures.uncertain += estimate.certain ? 0 : 1;
  ++figures.count;
}

/// Runs the filter on a drive, starting at an error drawn from its covariance.
void run(const Drive& drive, const World& world, const OneOfMany& one, Random& random, Figures& figures) {
  RiekfLocalizer filter(Landmarks(world.tags), {one.robot.camera, one.robot.model.base_T_cam}, one.options);
  testing::TrueNoise noise = one.noise;
  noise.start_m = noise.start_rad = 0.02;
  const auto bounds = testing::posterior_bound(drive.samples, drive.truth, world.tags, one.robot.camera,
                                               one.robot.model.base_T_cam, noise);
  const SE2 start = project_to_plane(drive.truth.front().map_T_base);
  filter.start_from({start.x() + random.normal(0, 0.02), start.y() + random.normal(0, 0.02),
                     start.yaw() + random.normal(0, 0.02)},
                    0.02, 0.02);
  std::size_t messages = 0;
  std::size_t frames = 0;
  for (const Sample& sample : drive.samples) {
    if (const auto* tags = std::get_if<TagFrame>(&sample)) {
      filter.add(*tags);
      ++frames;
    }
    if (const auto* odometry = std::get_if<Odometry>(&sample)) {
      Odometry askew = *odometry;
      askew.odom_T_base = SE2(SO2(askew.odom_T_base.yaw() + one.askew_rad), askew.odom_T_base.translation());
      filter.add(askew);
      const auto truth = drive.at(odometry->stamp);
      const auto estimate = filter.estimate();
      const auto bound = std::ranges::lower_bound(bounds, odometry->stamp, {}, &testing::BoundAt::stamp);
      // Every 0.5 s, because errors close in time are nearly equal.
      if (++messages % 25 == 0 && truth && estimate && bound != bounds.end())
        score(*estimate, *truth, bound->covariance, messages / 25, figures);
    }
    for (const NisRecord& record : filter.comparisons())
      add_to(figures.nis, frames / 8, record.nis, record.rows);
    filter.clear_comparisons();
  }
}

using Kind = OneOfMany (*)(RobotDescription, Random&);

/// Each drive has another robot. The mean over the drives at one time has a 95 % interval (Bar-Shalom, Li and
/// Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4.2).
void consistent_and_efficient(const std::string& world_name, const std::string& robot_name, Kind kind) {
  const char* odometry = kind == with_wheels_and_gyro ? "LIMO, wheels and gyro" : "odometry of the exercise";
  const World world = world_named(world_name);
  const int drives = full() ? 50 : 20;
  Figures all;
  for (int seed = 1; seed <= drives; ++seed) {
    Random random(static_cast<std::uint64_t>(5000 + seed));
    const OneOfMany one = kind(robot_named(robot_name), random);
    const Drive lap = drive(world, one.robot, static_cast<std::uint64_t>(seed), 60);
    run(lap, world, one, random, all);
  }
  std::erase_if(all.nees, [&](const Moment& m) { return m.freedom < 3 * drives; });
  std::erase_if(all.nis, [](const Moment& m) { return m.freedom <= 0; });
  const double nees = 3 * mean_of(all.nees);
  const double nis = mean_of(all.nis);
  std::printf(
      "%d drives, stated %.2f mm\nfigures: %s, %s | %.2f | %.2f | %.3f | %.2f | %.0f %% | %.3f | %.0f %%\n",
      drives, 1e3 * std::sqrt(all.covariance_m2 / all.count), world_name.c_str(), odometry,
      1e3 * all.rmse_m(), 1e3 * all.bound_m(), all.rmse_m() / all.bound_m(), nees,
      100 * share_inside(all.nees), nis, 100 * share_inside(all.nis));
  // Few drives scatter more; the published figures are those of fifty.
  EXPECT_LT(all.rmse_m(), (full() ? 1.15 : 1.3) * all.bound_m());
  EXPECT_GT(all.rmse_m(), (full() ? 0.9 : 0.75) * all.bound_m())
      << "better than the bound, which indicates an error";
  EXPECT_NEAR(nees, 3, 1.96 * std::sqrt(6.0 / drives));
  EXPECT_NEAR(nis, 1, 0.02);
  // 95 % of the times, of which about thirty per drive are independent.
  const auto overconfident = std::ranges::count_if(
      all.nees, [](const Moment& m) { return m.sum > m.freedom + 1.96 * std::sqrt(2 * m.freedom); });
  EXPECT_LT(static_cast<double>(overconfident), 0.1 * static_cast<double>(all.nees.size()));
  EXPECT_GT(share_inside(all.nees), full() ? 0.86 : 0.75);
  EXPECT_GT(share_inside(all.nis), full() ? 0.86 : 0.75);
  EXPECT_EQ(all.uncertain, 0);
}

TEST(LocalizationInSimulation, Circuit24IsConsistentAndEfficient) {
  consistent_and_efficient("circuit24", "limo", with_wheels_and_gyro);
}
TEST(LocalizationInSimulation, TheOdometryOfTheExerciseIsConsistentAndEfficient) {
  consistent_and_efficient("circuit24", "limo", with_walking_odometry);
}
TEST(LocalizationInSimulation, TheAcademysHouseIsConsistentAndEfficient) {
  consistent_and_efficient("academy-house", "turtlebot3-waffle", with_walking_odometry);
}

}  // namespace
}  // namespace waymark
