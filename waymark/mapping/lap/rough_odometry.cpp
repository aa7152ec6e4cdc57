#include "waymark/mapping/lap/rough_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"
#include "waymark/mapping/lap/tag_motions.hpp"

namespace waymark::internal {
namespace {

/// Motion of the base within a short time window according to tags, odometry and the gyro.
struct Window {
  double duration_s = 0;
  SE2::Tangent tags = SE2::Tangent::Zero();
  SE2::Tangent wheels = SE2::Tangent::Zero();
  std::optional<double> gyro_rad{};
};

/// The frames on the floor of each camera; a window starts and ends with a frame from the same camera.
std::vector<std::vector<FloorFrame>> by_camera(const LapInput& lap, const TagShapes& shapes,
                                               const std::vector<ObservedFrame>& observed) {
  std::vector<std::vector<FloorFrame>> cameras(1 + lap.more_cameras.size());
  for (std::size_t i = 0; i < observed.size(); ++i) {
    const auto other = std::ranges::find(lap.more_cameras, lap.frames[i].camera, &MountedCamera::name);
    const bool first = other == lap.more_cameras.end();
    cameras[first ? 0 : static_cast<std::size_t>(other - lap.more_cameras.begin()) + 1].push_back(
        floor_frame(observed[i], shapes, lap.base_T_cam, {}));
  }
  return cameras;
}

void add_windows(const LapInput& lap, const std::vector<FloorFrame>& frames, std::vector<Window>& windows) {
  constexpr double kMinWindow_s = 0.8;
  constexpr double kMaxWindow_s = 1.2;
  const OdometryTrack wheels(lap.odometry);
  const GyroTrack gyro(lap.imu);
  std::size_t j = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    while (j < frames.size() && to_seconds(frames[j].stamp - frames[i].stamp) < kMinWindow_s) ++j;
    if (j == frames.size()) break;
    const double duration_s = to_seconds(frames[j].stamp - frames[i].stamp);
    const auto a = wheels.at(frames[i].stamp);
    const auto b = wheels.at(frames[j].stamp);
    const auto tags = motion_by_tags(frames[i], frames[j]);
    if (duration_s > kMaxWindow_s || !a || !b || !tags) continue;
    Window window{duration_s, tags->twist, (a->inverse() * *b).log(),
                  gyro.turn(frames[i].stamp, frames[j].stamp)};
    constexpr double kMaxTurn_rad = 2.5;  // larger rotations are ambiguous by a full turn
    if (std::abs(window.wheels[2]) < kMaxTurn_rad) windows.push_back(window);
  }
}

std::vector<Window> windows_of(const LapInput& lap, const std::vector<ObservedFrame>& observed) {
  const TagShapes shapes = tag_shapes(observed, lap.base_T_cam, {});
  std::vector<Window> windows;
  for (const auto& of_camera : by_camera(lap, shapes, observed)) add_windows(lap, of_camera, windows);
  return windows;
}

/// Pairs of a measured value and the corresponding true value.
using Pairs = std::vector<std::pair<double, double>>;

/// The factor that minimises the absolute deviations; empty if the pairs do not determine it.
std::optional<double> scale_of(const Pairs& pairs, double min_sum) {
  constexpr std::size_t kMinPairs = 30;
  constexpr double kOverlap = 10;  // one-second windows start at every frame and are not independent
  constexpr double kMaxSigma = 0.1;
  double sum = 0;
  std::vector<std::pair<double, double>> ratios;  // ratios and their weights
  for (const auto& [odometry, truth] : pairs) {
    if (odometry == 0) continue;
    ratios.emplace_back(truth / odometry, std::abs(odometry));
    sum += std::abs(odometry);
  }
  if (ratios.size() < kMinPairs || sum < min_sum) return std::nullopt;
  std::ranges::sort(ratios);
  double below = 0;
  double scale = 0;
  for (const auto& [ratio, weight] : ratios) {
    scale = ratio;
    below += weight;
    if (below >= sum / 2) break;
  }
  std::vector<double> off;
  for (const auto& [odometry, truth] : pairs) off.push_back(std::abs(truth - scale * odometry));
  const auto n = static_cast<double>(ratios.size());
  const double sigma = 1.5 * median(std::move(off)) / (sum / n) * std::sqrt(kOverlap / n);
  if (!(scale > 0) || sigma > kMaxSigma * scale) return std::nullopt;
  return scale;
}

double median_off(const Pairs& pairs, double scale) {
  std::vector<double> off;
  for (const auto& [odometry, truth] : pairs) off.push_back(std::abs(truth - scale * odometry));
  return off.empty() ? 0 : median(std::move(off));
}

constexpr double kMinTurn_rad = 6;  // total over all windows, which overlap
constexpr double kMinDistance_m = 5;

/// A gyro model: true turn = scale * measured turn - bias * time.
struct Gyro {
  double scale = 1, bias_rad_s = 0;
  double off_rad = 0;  ///< median absolute residual
};

/// Minimises absolute deviations by iteratively reweighted least squares. Scale and bias are estimated
/// together, because on a course with bends mostly to one side they are strongly correlated.
std::optional<Gyro> fit_gyro(const std::vector<Window>& windows) {
  constexpr int kRounds = 30;
  constexpr double kMinResidual_rad = 1e-3;
  constexpr double kScaleSigma = 0.1;
  constexpr double kBiasSigma_rad_s = 0.1;
  const Eigen::Vector2d usual(1, 0);
  const Eigen::Matrix2d prior =
      Eigen::Vector2d(1 / kScaleSigma, 1 / kBiasSigma_rad_s).cwiseAbs2().asDiagonal();
  Eigen::Vector2d x = usual;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix2d A = prior;
    Eigen::Vector2d b = prior * usual;
    for (const Window& w : windows) {
      if (!w.gyro_rad) continue;
      const Eigen::Vector2d row(*w.gyro_rad, -w.duration_s);
      const double weight = 1 / std::max(std::abs(w.tags[2] - row.dot(x)), kMinResidual_rad);
      A += weight * row * row.transpose();
      b += weight * w.tags[2] * row;
    }
    x = A.ldlt().solve(b);
  }
  Gyro gyro{.scale = x[0], .bias_rad_s = x[1]};
  Pairs pairs;
  for (const Window& w : windows) {
    if (w.gyro_rad) pairs.emplace_back(*w.gyro_rad, w.tags[2] + gyro.bias_rad_s * w.duration_s);
  }
  if (!scale_of(pairs, kMinTurn_rad)) return std::nullopt;
  gyro.off_rad = median_off(pairs, gyro.scale);
  return gyro;
}

/// Odometry made up of the original motions in order, each modified by `change`.
template <class Change>
std::vector<Odometry> with_changed_motions(const std::vector<Odometry>& odometry, const Change& change) {
  std::vector<Odometry> result;
  result.reserve(odometry.size());
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    Odometry sample = odometry[i];
    if (i > 0) {
      const SE2::Tangent twist = (odometry[i - 1].odom_T_base.inverse() * sample.odom_T_base).log();
      sample.odom_T_base =
          result.back().odom_T_base * SE2::exp(change(twist, odometry[i - 1].stamp, sample.stamp));
    }
    result.push_back(sample);
  }
  return result;
}

/// Finds odometry steps without gyro samples; adjacent ones are merged.
void find_gaps(const std::vector<Odometry>& odometry, const GyroTrack& gyro, RoughOdometry& rough) {
  double missing_s = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    const SensorTime from = odometry[i - 1].stamp;
    const SensorTime to = odometry[i].stamp;
    if (!(from < to) || gyro.turn(from, to)) continue;
    missing_s += to_seconds(to - from);
    if (!rough.without_gyro.empty() && rough.without_gyro.back().to == from)
      rough.without_gyro.back().to = to;
    else
      rough.without_gyro.push_back({from, to});
  }
  if (odometry.size() < 2) return;
  const double all_s = to_seconds(odometry.back().stamp - odometry.front().stamp);
  rough.without_gyro_share = all_s > 0 ? missing_s / all_s : 0;
}

}  // namespace

RoughOdometry rough_odometry(const LapInput& lap, const std::vector<ObservedFrame>& observed) {
  constexpr double kMaxLogScale = 0.2;  // the bundle itself can estimate smaller scale errors
  constexpr double kMaxErrorRatio = 0.7;
  RoughOdometry rough{.odometry = lap.odometry};
  const std::vector<Window> windows = windows_of(lap, observed);
  Pairs turns;
  Pairs ways;
  for (const Window& w : windows) {
    turns.emplace_back(w.wheels[2], w.tags[2]);
    ways.emplace_back(w.wheels[0], w.tags[0]);
  }
  const auto yaw = scale_of(turns, kMinTurn_rad);
  const auto distance = scale_of(ways, kMinDistance_m);
  const auto off = [&](const std::optional<double>& scale) {
    return scale && std::abs(std::log(*scale)) > kMaxLogScale ? *scale : 1.0;
  };
  rough.yaw = off(yaw);
  rough.distance = off(distance);
  const auto gyro = fit_gyro(windows);
  Pairs beside_gyro;
  for (const Window& w : windows) {
    if (w.gyro_rad) beside_gyro.emplace_back(w.wheels[2], w.tags[2]);
  }
  const GyroTrack track(lap.imu);
  find_gaps(lap.odometry, track, rough);
  rough.turns_by_gyro = gyro && gyro->off_rad < kMaxErrorRatio * median_off(beside_gyro, yaw.value_or(1));
  if (!rough.turns_by_gyro && rough.yaw == 1 && rough.distance == 1) return rough;
  if (rough.turns_by_gyro) rough.yaw = yaw.value_or(1);
  rough.odometry =
      with_changed_motions(lap.odometry, [&](SE2::Tangent twist, SensorTime from, SensorTime to) {
        const auto turned = rough.turns_by_gyro ? track.turn(from, to) : std::nullopt;
        const double turn =
            turned ? gyro->scale * *turned - gyro->bias_rad_s * to_seconds(to - from) : rough.yaw * twist[2];
        return SE2::Tangent(rough.distance * twist[0], rough.distance * twist[1], turn);
      });
  return rough;
}

}  // namespace waymark::internal
