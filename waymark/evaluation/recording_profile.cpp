#include "waymark/evaluation/recording_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr double kStanding = 0.01;   // m/s, rad/s
constexpr double kSettling_s = 0.3;  // oscillation after a stop is not a bias
constexpr double kNormal =
    1.4826;  // from median absolute deviation to standard deviation for a normal distribution
constexpr std::size_t kMinSamples = 20;  // minimum for computing a statistic

double spread(std::vector<double> values) {
  const double middle = quantile(values, 0.5);
  for (double& value : values) value = std::abs(value - middle);
  return quantile(std::move(values), 0.5);
}

std::vector<double> steps_of(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] > stamps[i - 1]) steps.push_back(stamps[i] - stamps[i - 1]);
  }
  return steps;
}

/// Longer steps count as gaps.
double longest_regular(const std::vector<double>& steps) { return std::max(0.3, 5 * quantile(steps, 0.5)); }

StreamProfile stream_of(const std::vector<double>& stamps) {
  StreamProfile stream{.samples = static_cast<int>(stamps.size())};
  const std::vector<double> steps = steps_of(stamps);
  if (steps.empty()) return stream;
  const double most = longest_regular(steps);
  double sum = 0;
  double regular = 0;
  for (const double step : steps) {
    if (step > most) continue;
    sum += step;
    regular += 1;
  }
  stream.rate_hz = regular / sum;
  stream.jitter_s = spread(steps);
  stream.longest_gap_s = std::ranges::max(steps);
  return stream;
}

std::vector<Gap> gaps_of(const std::vector<double>& stamps) {
  const double most = longest_regular(steps_of(stamps));
  std::vector<Gap> gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double step = stamps[i] - stamps[i - 1];
    if (step > most) gaps.push_back({stamps[i - 1], step});
  }
  return gaps;
}

/// The newest value at a given time; `at` only advances from call to call.
template <class Point>
const Point& held(const std::vector<Point>& points, double at_s, std::size_t& at) {
  while (at + 1 < points.size() && points[at + 1].at_s <= at_s) ++at;
  return points[at];
}

}  // namespace

double RecordingProfiler::seconds(SensorTime stamp) {
  if (!first_) first_ = stamp;
  return to_seconds(stamp - *first_);
}

void RecordingProfiler::add(const ImuSample& imu, double at_s) {
  stamps_["imu"].push_back(at_s);
  gyro_.push_back({at_s, 0, imu.angular_velocity_rad_s.z()});
  acceleration_.push_back(imu.linear_acceleration_m_s2.z());
}

void RecordingProfiler::add(const TagPoseFrame& frame, double at_s) {
  TagFrame seen{.stamp = frame.stamp, .camera = frame.camera};
  for (const SeenTagPose& tag : frame.tags) {
    seen.detections.push_back({.tag = tag.tag});
    seen.detections.back().corners_px.fill(Eigen::Vector2d::Constant(std::nan("")));
  }
  cameras_[frame.camera].stamps.push_back(at_s);
  cameras_[frame.camera].frames.push_back(std::move(seen));
}

void RecordingProfiler::add(const Sample& sample) {
  const double at_s = seconds(stamp_of(sample));
  if (const auto* frame = std::get_if<TagFrame>(&sample)) {
    cameras_[frame->camera].stamps.push_back(at_s);
    cameras_[frame->camera].frames.push_back(*frame);
  } else if (const auto* poses = std::get_if<TagPoseFrame>(&sample)) {
    add(*poses, at_s);
  } else if (const auto* image = std::get_if<CameraFrame>(&sample)) {
    cameras_[image->camera].images.push_back(at_s);
  } else if (const auto* odometry = std::get_if<Odometry>(&sample)) {
    stamps_["odometry"].push_back(at_s);
    odometry_.push_back({at_s, odometry->speed_m_s, odometry->yaw_rate_rad_s});
  } else if (const auto* command = std::get_if<StampedCommand>(&sample)) {
    stamps_["commands"].push_back(at_s);
    commands_.push_back({at_s, command->command.speed_m_s, command->command.yaw_rate_rad_s});
  } else if (const auto* imu = std::get_if<ImuSample>(&sample)) {
    add(*imu, at_s);
  } else if (std::holds_alternative<LaserScan>(sample)) {
    stamps_["lidar"].push_back(at_s);
  }
}

void RecordingProfiler::measure_imu(RecordingProfile& profile) const {
  // Second differences of white noise have six times its variance; motion adds very little.
  const auto white = [](const auto& values, const auto& value) {
    std::vector<double> differences;
    for (std::size_t i = 2; i < values.size(); ++i)
      differences.push_back((value(values[i]) - 2 * value(values[i - 1]) + value(values[i - 2])) /
                            std::sqrt(6.0));
    return kNormal * spread(std::move(differences));
  };
  if (gyro_.size() < kMinSamples) return;
  profile.gyro_noise_rad_s = white(gyro_, [](const Speed& s) { return s.rad_s; });
  profile.acceleration_noise_m_s2 = white(acceleration_, [](double a) { return a; });
  std::vector<double> standing;
  double moved_s = -kSettling_s;
  std::size_t at = 0;
  for (const Speed& rate : gyro_) {
    if (odometry_.empty()) break;
    const Speed& speed = held(odometry_, rate.at_s, at);
    if (std::abs(speed.m_s) >= kStanding || std::abs(speed.rad_s) >= kStanding) moved_s = rate.at_s;
    if (rate.at_s - moved_s >= kSettling_s) standing.push_back(rate.rad_s);
  }
  if (standing.size() >= kMinSamples) profile.gyro_bias_rad_s = quantile(std::move(standing), 0.5);
}

void RecordingProfiler::measure_cameras(RecordingProfile& profile) const {
  const Camera* busiest = nullptr;
  for (const auto& [name, camera] : cameras_) {
    const std::vector<double>& times = camera.times();
    if (cameras_.size() > 1) profile.streams["camera " + name] = stream_of(times);
    if (busiest != nullptr && times.size() <= busiest->times().size()) continue;
    busiest = &camera;
    profile.camera = name;
  }
  if (busiest == nullptr) return;
  profile.streams["camera"] = stream_of(busiest->times());
  profile.duration_s = std::max(profile.duration_s, std::ranges::max(busiest->times()));
  profile.camera_gaps = gaps_of(busiest->times());
  measure_tags(busiest->frames, profile);
}

/// Second differences of the corners, in units of the noise of one coordinate. The common motion of the tag,
/// caused for example by camera shake, is removed, and a quarter of the variance with it.
void RecordingProfiler::add_corner_noise(const TagDetection& first, const TagDetection& middle,
                                         const TagDetection& last, std::vector<double>& noise) {
  const double scale = std::sqrt(4.0 / 3) / std::sqrt(6.0);
  std::array<Eigen::Vector2d, 4> bend{};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    bend[k] = last.corners_px[k] - 2 * middle.corners_px[k] + first.corners_px[k];
    mean += bend[k] / 4;
  }
  for (const Eigen::Vector2d& corner : bend) {
    noise.push_back(scale * (corner - mean).x());
    noise.push_back(scale * (corner - mean).y());
  }
}

void RecordingProfiler::measure_tags(const std::vector<TagFrame>& frames, RecordingProfile& profile) {
  if (frames.size() < kMinSamples) return;
  const auto find = [](const TagFrame& frame, const TagId& tag) {
    const auto it = std::ranges::find(frame.detections, tag, &TagDetection::tag);
    return it == frame.detections.end() ? nullptr : &*it;
  };
  std::vector<double> differences;
  double seen = 0;
  double missed = 0;
  double tags = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    tags += static_cast<double>(frames[i].detections.size());
    if (i < 2) continue;
    for (const TagDetection& last : frames[i].detections) {
      const TagDetection* first = find(frames[i - 2], last.tag);
      const TagDetection* middle = find(frames[i - 1], last.tag);
      if (first == nullptr) continue;
      (middle == nullptr ? missed : seen) += 1;
      if (middle == nullptr || !last.corners_px[0].allFinite()) continue;
      if (!usable_corners(*first) || !usable_corners(*middle) || !usable_corners(last)) continue;
      add_corner_noise(*first, *middle, last, differences);
    }
  }
  profile.tags_per_frame = tags / static_cast<double>(frames.size());
  if (seen + missed > 0) profile.miss_probability = missed / (seen + missed);
  if (differences.size() >= kMinSamples) profile.corner_sigma_px = kNormal * spread(std::move(differences));
}

void RecordingProfiler::measure_motion(RecordingProfile& profile) const {
  if (odometry_.empty()) return;
  std::vector<double> speeds;
  std::vector<double> rates;
  std::size_t at = 0;
  int standing = 0;
  int turning = 0;
  const double end_s = odometry_.back().at_s;
  for (double t = 0; t <= end_s; t += 0.1) {
    const Speed& now = held(odometry_, t, at);
    profile.speeds.push_back({t, now.m_s});
    const bool at_standstill = std::abs(now.m_s) < kStanding;
    standing += at_standstill ? 1 : 0;
    turning += at_standstill && std::abs(now.rad_s) > 10 * kStanding ? 1 : 0;
    if (at_standstill) continue;
    speeds.push_back(std::abs(now.m_s));
    rates.push_back(std::abs(now.rad_s));
  }
  profile.standing_share = static_cast<double>(standing) / static_cast<double>(profile.speeds.size());
  profile.turning_share = static_cast<double>(turning) / static_cast<double>(profile.speeds.size());
  for (const double speed : speeds) profile.mean_speed_m_s += speed / static_cast<double>(speeds.size());
  profile.p95_speed_m_s = quantile(speeds, 0.95);
  profile.p95_yaw_rate_rad_s = quantile(rates, 0.95);
  if (commands_.size() < kMinSamples) return;
  constexpr double kMaxDelay_s = 0.6;
  double best = std::numeric_limits<double>::infinity();
  for (double delay = 0; delay <= kMaxDelay_s; delay += 0.01) {
    std::size_t from = 0;
    double error = 0;
    double moments = 0;
    for (const Speed& is : odometry_) {
      if (is.at_s - delay < commands_.front().at_s) continue;
      const Speed& asked = held(commands_, is.at_s - delay, from);
      error += std::pow(is.m_s - asked.m_s, 2);
      moments += 1;
    }
    if (moments < 1 || error / moments >= best) continue;
    best = error / moments;
    profile.command_delay_s = delay;
  }
  // If the best delay is at the limit of the search, the speeds do not follow these commands.
  if (profile.command_delay_s > kMaxDelay_s - 0.05) profile.command_delay_s.reset();
}

RecordingProfile RecordingProfiler::profile() const {
  RecordingProfile profile;
  for (const auto& [kind, stamps] : stamps_) {
    profile.streams[kind] = stream_of(stamps);
    if (!stamps.empty()) profile.duration_s = std::max(profile.duration_s, std::ranges::max(stamps));
  }
  if (const auto odometry = stamps_.find("odometry"); odometry != stamps_.end())
    profile.odometry_gaps = gaps_of(odometry->second);
  measure_cameras(profile);
  measure_imu(profile);
  measure_motion(profile);
  return profile;
}

namespace {

constexpr Duration kMaxPoseGap = std::chrono::milliseconds(500);

/// Integral of the commanded yaw rate between two points in time; each command applies until the next.
double commanded_rad(const std::vector<StampedCommand>& commands, std::size_t& at, SensorTime from,
                     SensorTime to) {
  while (at + 1 < commands.size() && commands[at + 1].stamp <= from) ++at;
  double turned_rad = 0;
  for (std::size_t i = at; i < commands.size() && commands[i].stamp < to; ++i) {
    const SensorTime begins = std::max(commands[i].stamp, from);
    const SensorTime ends = i + 1 < commands.size() ? std::min(commands[i + 1].stamp, to) : to;
    turned_rad += commands[i].command.yaw_rate_rad_s * to_seconds(ends - begins);
  }
  return turned_rad;
}

}  // namespace

std::optional<double> turn_response(const std::vector<StampedCommand>& commands, const Trajectory& trajectory,
                                    double delay_s) {
  constexpr Duration kWindow = std::chrono::milliseconds(500);
  constexpr int kMinWindows = 20;
  const double least_rad = to_radians(2);
  if (commands.empty() || trajectory.empty()) return std::nullopt;
  const auto delay = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(delay_s));
  std::size_t at = 0;
  double product = 0;
  double square = 0;
  int windows = 0;
  for (SensorTime from = std::max(trajectory.front().stamp, commands.front().stamp + delay);
       from + kWindow <= trajectory.back().stamp; from += kWindow) {
    const double asked_rad = commanded_rad(commands, at, from - delay, from + kWindow - delay);
    const auto begin = pose_at(trajectory, from, kMaxPoseGap);
    const auto end = pose_at(trajectory, from + kWindow, kMaxPoseGap);
    if (!begin || !end) continue;
    product += asked_rad * project_to_plane(begin->inverse() * *end).yaw();
    square += asked_rad * asked_rad;
    windows += std::abs(asked_rad) >= least_rad ? 1 : 0;
  }
  return windows < kMinWindows ? std::nullopt : std::optional(product / square);
}

std::optional<double> observation_distance_m(const std::vector<TagFrame>& frames, const TagMap& map,
                                             const SE3& base_T_cam, const Trajectory& trajectory,
                                             double share) {
  constexpr std::size_t kMinObservations = 50;
  std::vector<double> distances_m;
  for (const TagFrame& frame : frames) {
    const auto map_T_base = pose_at(trajectory, frame.stamp, kMaxPoseGap);
    if (!map_T_base) continue;
    const Eigen::Vector3d eye = (*map_T_base * base_T_cam).translation();
    for (const TagDetection& seen : frame.detections) {
      const MappedTag* tag = map.find(seen.tag);
      if (tag != nullptr) distances_m.push_back((tag->map_T_tag.translation() - eye).norm());
    }
  }
  if (distances_m.size() < kMinObservations) return std::nullopt;
  return quantile(std::move(distances_m), share);
}

}  // namespace waymark
