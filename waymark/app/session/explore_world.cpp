#include "waymark/app/session/explore_world.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/runtime/explore_session.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

/// For robots whose file does not describe a lidar, the one on LIMO is used, with eight scans per second.
constexpr double kUsualLidar_hz = 8;

Result<TagMap> tags_of(const RobotSetup& setup, const ExploreJob& job) {
  if (job.map.empty()) return setup.simulated.world.tags;
  const auto file = or_wrong_kind(read_map(map_file_of(job.map)), job.map, FileUse::OwnMap);
  if (!file) return tl::unexpected(file.error());
  return file->tags;
}

/// Compares an exploring robot with ground truth.
class Judge {
 public:
  Judge(const World& world, const Hull& hull) : world_(world), hull_(hull) {}

  void receive(const TruthPose& truth) {
    const SE2 map_T_base = project_to_plane(truth.map_T_base);
    if (!path_.empty())
      distance_m_ += (map_T_base.translation() - path_.rbegin()->second.translation()).norm();
    path_[truth.stamp] = map_T_base;
    constexpr std::size_t kOneSecond = 50;
    if (path_.size() > kOneSecond) path_.erase(path_.begin());
    const double near_m = obstacle_distance_m(world_, hull_, map_T_base);
    if (near_m <= 0 && nearest_now_m_ > 0) ++collisions_;
    nearest_now_m_ = near_m;
    nearest_m_ = std::min(nearest_m_, near_m);
  }
  void receive(const LocalizationEstimate& estimate) {
    ++estimates_;
    if (!estimate.certain || path_.empty()) return;
    const auto after = path_.lower_bound(estimate.stamp);
    const SE2 error =
        (after == path_.end() ? path_.rbegin()->second : after->second).inverse() * estimate.map_T_base;
    position_m_.push_back(error.translation().norm());
    heading_square_ += error.yaw() * error.yaw();
  }
  void fill(ExploreReport& report) const {
    report.distance_m = distance_m_;
    report.collisions = collisions_;
    report.nearest_m = nearest_m_;
    report.estimates = estimates_;
    if (position_m_.empty()) return;
    const auto n = static_cast<double>(position_m_.size());
    report.certain_fraction = n / static_cast<double>(estimates_);
    double square = 0;
    for (const double e : position_m_) square += e * e;
    report.position_rmse_m = std::sqrt(square / n);
    report.position_p95_m = quantile(position_m_, 0.95);
    report.position_max_m = std::ranges::max(position_m_);
    report.heading_rmse_deg = to_degrees(std::sqrt(heading_square_ / n));
  }

 private:
  const World& world_;
  Hull hull_;
  std::map<SensorTime, SE2> path_{};  ///< path during the last second
  double distance_m_ = 0;
  int collisions_ = 0;
  double nearest_now_m_ = std::numeric_limits<double>::infinity();
  double nearest_m_ = std::numeric_limits<double>::infinity();
  std::size_t estimates_ = 0;
  std::vector<double> position_m_{};
  double heading_square_ = 0;
};

/// The listeners for an exploring robot: evaluation, recording and control.
ExploreListener listener_of(Judge& judge, std::optional<SampleRecorder>& recorder,
                            const JobControl& control) {
  return {.on_sample = [&judge, &recorder](const Sample& sample) -> Status {
            if (const auto* truth = std::get_if<TruthPose>(&sample)) judge.receive(*truth);
            return recorder ? recorder->add(sample) : Status();
          },
          .on_step = [&judge, &recorder](SensorTime now, const ExploreStep&,
                                         const std::optional<LocalizationEstimate>& estimate) -> Status {
            if (estimate) judge.receive(*estimate);
            if (!recorder || !estimate || !estimate->certain) return {};
            return recorder->add_message(topics::kEstimate, now, estimate_message(*estimate));
          },
          .on_progress = [&control](const std::string& line) { control.progress({.text = line}); }};
}

Explorer explorer_of(const SimulatedSetup& setup, const ExploreOptions& options) {
  constexpr std::uint64_t kExploreSeed = 2000;  // makes the turns independent of sensor noise
  const LidarOptions& lidar = setup.robot.lidar;
  return {options, setup.model, SE2(lidar.x_m, lidar.y_m, to_radians(lidar.yaw_deg)),
          Random(setup.robot.seed + kExploreSeed)};
}

Result<std::optional<SampleRecorder>> recorder_of(const RobotSetup& setup, const ExploreJob& job) {
  if (job.output.empty()) return std::optional<SampleRecorder>();
  Result<SampleRecorder> recorder = start_recording(
      job.output,
      {.verb = "explore", .driver = "explore", .options = "explore:\n" + write_fields(job.explore, 2)},
      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  return std::optional<SampleRecorder>(std::move(*recorder));
}

}  // namespace

Result<ExploreReport> explore_world(RobotSetup setup, const ExploreJob& job, const JobControl& control) {
  const Stopwatch watch;
  SimulatedSetup& simulated = setup.simulated;
  if (simulated.robot.lidar.rate_hz <= 0) simulated.robot.lidar.rate_hz = kUsualLidar_hz;
  auto tags = tags_of(setup, job);
  if (!tags) return tl::unexpected(tags.error());
  auto localizer =
      Localizer::make({.landmarks = Landmarks(*tags),
                       .tags = *tags,
                       .sensor = {simulated.camera, simulated.model.base_T_cam, simulated.more_cameras},
                       .filter = job.filter});
  if (!localizer) return tl::unexpected(localizer.error());
  auto recorder = recorder_of(setup, job);
  if (!recorder) return tl::unexpected(recorder.error());
  Judge judge(simulated.world, simulated.model.hull);
  const double max_s = 60 * job.minutes;
  ExploreSession session(explorer_of(simulated, job.explore), std::move(*localizer), *tags, max_s,
                         listener_of(judge, *recorder, control));
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return session.receive(sample); };
  listener.should_stop = control.cancelled;
  const auto end = drive_lap(
      simulated,
      [&](const SE2& /*map_T_base*/, Duration uptime, SensorTime now) { return session.decide(uptime, now); },
      listener, max_s + 1);
  const Status closed = *recorder ? (*recorder)->close() : Status();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  const ExploreEnd explored = session.end();
  ExploreReport report{.interrupted = end->interrupted,
                       .halt_reason = explored.halt_reason,
                       .seconds = end->lap_s,
                       .turns = explored.turns,
                       .tags = tags->tags.size()};
  for (const auto& [tag, frames] : explored.seen) report.seen.push_back(to_string(tag));
  judge.fill(report);
  report.wall_s = watch.seconds();
  return report;
}

std::string to_text(const ExploreReport& r) {
  std::string text = fmt::format("{:.0f} s, {:.1f} m, {} turns; {} of {} tags seen\n", r.seconds,
                                 r.distance_m, r.turns, r.seen.size(), r.tags);
  text += fmt::format("{} collisions, ", r.collisions);
  text += std::isfinite(r.nearest_m) ? fmt::format("smallest clearance {:.3f} m from the hull\n", r.nearest_m)
                                     : "this world has no obstacles\n";
  if (!r.position_rmse_m) return text + "the pose was never certain\n";
  return text + fmt::format(
                    "the pose was certain {:.1f} % of the time; its errors against ground truth:\n"
                    "  position  {:.3f} m rmse, {:.3f} m 95 %, {:.3f} m max\n"
                    "  heading   {:.2f} deg rmse\n",
                    100 * r.certain_fraction, *r.position_rmse_m, *r.position_p95_m, *r.position_max_m,
                    *r.heading_rmse_deg);
}

ReportFields fields(const ExploreReport& r) {
  const auto nearest_m = std::isfinite(r.nearest_m) ? std::optional(r.nearest_m) : std::nullopt;
  return {
      {"seconds", "Duration of the drive [s]", r.seconds},
      {"distance_m", "Driven distance, by the ground truth", r.distance_m},
      {"turns", "Number of turns on the spot", r.turns},
      {"tags_seen", "Names of the observed map tags", r.seen},
      {"tags", "Number of tags in the map", r.tags},
      {"collisions", "How often the hull hit a wall or furniture, by the ground truth", r.collisions},
      {"nearest_m", "Smallest distance from the hull to walls and furniture, by ground truth; null: none",
       nearest_m},
      {"certain_fraction", "Share of the estimates that were certain", r.certain_fraction},
      {"position_rmse_m",
       "Root mean square distance of certain estimates from the ground truth; null: no estimate was certain",
       r.position_rmse_m},
      {"position_p95_m", "95th percentile of these distances", r.position_p95_m},
      {"position_max_m", "Largest of these distances", r.position_max_m},
      {"heading_rmse_deg", "Root mean square heading error of certain estimates, by the ground truth",
       r.heading_rmse_deg},
      {"halt_reason", "Why the robot was stopped at the end; empty: it was driving", r.halt_reason},
      {"wall_s", "Elapsed real time", r.wall_s}};
}

}  // namespace waymark
