#pragma once

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

/// Laps of circuit24 with noisy corners, and the scores of their maps.
namespace waymark::test {

inline const World& circuit() {
  static const World world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value();
  return world;
}

struct Lap {
  LapInput input;
  Trajectory truth{};
  std::vector<ImuSample> imu{};
};

inline const RobotDescription& limo() {
  static const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  return robot;
}

inline Lap drive(std::uint64_t seed, const DriverOptions& driver = {}, const World& world = circuit(),
                 const RobotDescription& robot = limo()) {
  Lap lap{.input = {.camera = robot.camera,
                    .base_T_cam = robot.model.base_T_cam,
                    .sizes = {.default_size_m = 0.16},
                    .anchor = world.anchor,
                    .map_T_anchor = world.tags.find(world.anchor)->map_T_tag,
                    .more_cameras = robot.more_cameras}};
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) lap.input.frames.push_back(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.input.odometry.push_back(*odometry);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) lap.imu.push_back(*imu);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      lap.truth.push_back({truth->stamp, truth->map_T_base});
    return Status();
  };
  const SimulatedSetup setup{.world = world,
                             .model = robot.model,
                             .camera = robot.camera,
                             .robot = {.seed = seed},
                             .camera_name = robot.camera_name,
                             .more_cameras = robot.more_cameras};
  EXPECT_TRUE(drive_scripted_lap(setup, driver, listener));
  return lap;
}

inline BundleMap map_of(const LapInput& lap, const BundleMapOptions& options = {}) {
  auto map = map_by_bundle(lap, {}, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap{};
}

/// The sizes of simulated tags are exact. Only with this option is the covariance of a map the bound of its
/// errors.
inline BundleMapOptions exact_sizes() { return {.search = {.tag_size_sigma_percent = 0}}; }

inline Eigen::Matrix3d position_covariance(const SE3& map_T_x, const Matrix6& covariance) {
  return coordinate_covariance(Uncertain<SE3>{map_T_x, covariance}).topLeftCorner<3, 3>();
}

/// Squared errors and their Cramer-Rao bound over many laps.
struct Score {
  double squared = 0;
  double bound = 0;
  int count = 0;
  int inside = 0;             ///< number inside the 95 % ellipsoid
  std::vector<Score> laps{};  ///< cumulative sums after each lap
  void add(const Eigen::Vector3d& error, const Eigen::Matrix3d& P) {
    constexpr double k95 = 7.815;  // chi-square, 3 degrees of freedom
    squared += error.squaredNorm();
    bound += P.trace();
    inside += error.dot(P.llt().solve(error)) < k95 ? 1 : 0;
    ++count;
  }
  /// Ends a lap: everything added since the last call belongs to it.
  void end_lap() { laps.push_back({squared, bound, count, inside}); }
  [[nodiscard]] double ratio() const { return std::sqrt(squared / bound); }
  /// Standard deviations over the laps (jackknife: Efron and Tibshirani, "An Introduction to the Bootstrap",
  /// section 11.5).
  [[nodiscard]] double ratio_sigma() const {
    return jackknife([](const Score& score) { return score.ratio(); });
  }
  [[nodiscard]] double coverage_sigma() const {
    return jackknife([](const Score& score) { return score.coverage(); });
  }
  [[nodiscard]] double rmse_m() const { return std::sqrt(squared / count); }
  [[nodiscard]] double coverage() const { return static_cast<double>(inside) / count; }

  template <class Figure>
  [[nodiscard]] double jackknife(Figure&& figure) const {
    std::vector<double> without;
    Score before;
    for (const Score& upto : laps) {
      without.push_back(
          figure(Score{squared - (upto.squared - before.squared), bound - (upto.bound - before.bound),
                       count - (upto.count - before.count), inside - (upto.inside - before.inside)}));
      before = {upto.squared, upto.bound, upto.count, upto.inside};
    }
    const auto n = static_cast<double>(without.size());
    double mean = 0;
    for (const double value : without) mean += value / n;
    double sum = 0;
    for (const double value : without) sum += (value - mean) * (value - mean);
    return std::sqrt((n - 1) / n * sum);
  }
};

inline std::optional<SE3> true_pose(const Lap& lap, SensorTime stamp) {
  const auto after = std::ranges::lower_bound(lap.truth, stamp, {}, &StampedPose::stamp);
  if (after == lap.truth.begin() || after == lap.truth.end()) return std::nullopt;
  const auto before = std::prev(after);
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  return interpolate(before->map_T_base, after->map_T_base, share);
}

inline double worst_of_others(const BundleMap& map, const std::set<TagId>& spoiled) {
  double worst = 0;
  for (const auto& [id, tag] : map.map.tags) {
    if (spoiled.contains(id)) continue;
    worst = std::max(worst,
                     (tag.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation()).norm());
  }
  return worst;
}

}  // namespace waymark::test
