#include "waymark/app/replay/replay_route.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "waymark/app/common/route_files.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/replay/live_replay.hpp"
#include "waymark/app/replay/replay_log.hpp"
#include "waymark/app/replay/robot_difference.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/trajectory_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostMapBytes = std::size_t{1} << 26U;

/// A route that nobody drove is held against itself; closed, a little beyond its end.
Trajectory path_of(const Route& route) {
  Trajectory path;
  const std::size_t beyond = route.closed ? route.points.size() / 10 : 0;
  for (std::size_t i = 0; i < route.points.size() + beyond; ++i)
    path.push_back(
        {SensorTime(std::chrono::milliseconds(i)), lift(route.points[i % route.points.size()].map_T_base)});
  return path;
}

/// The true way of the lap that was taught; empty when nobody knows it.
Result<Trajectory> taught_path(const ReplayJob& job, const JobControl& control) {
  if (!job.taught.empty()) {
    Result<RecordedLap> lap = read_lap_file(job.taught, silent(control));
    if (!lap) return tl::unexpected(lap.error());
    if (lap->truth.empty())
      return fail(ErrorCode::NotFound, "this recording holds no truth to judge against",
                  {.source = job.taught});
    return std::move(lap->truth);
  }
  const fs::path beside = job.folder / file_name_for_route("truth_trajectory", job.route, ".txt");
  std::error_code ignored;
  if (!fs::exists(beside, ignored)) return Trajectory();
  return read_trajectory(beside);
}

}  // namespace

void judge(const RobotSetup& setup, ReplayReport& report) {
  if (report.taught_path.empty()) {
    report.warnings.emplace_back(
        "the true way of the teach lap is not known (--taught gives its recording): not judged");
    return;
  }
  const Result<ReplayJudgement> judgement = judge_replay(
      report.true_path, report.taught_path, setup.simulated.world.tags, setup.simulated.model.hull);
  if (judgement)
    report.judgement = *judgement;
  else
    report.warnings.push_back("not judged: " + to_string(judgement.error()));
}

Result<LocalizationKind> parse_replay_method(const std::string& name) {
  std::vector<std::string> known = localization_methods();
  std::erase(known, to_string(LocalizationKind::Smoother));
  if (std::ranges::find(known, name) != known.end()) return parse_localization_method(name);
  return fail(ErrorCode::InvalidArgument, fmt::format("there is no method '{}'", name), {.key = "--method"},
              suggestion(name, known));
}

Status choose_replay(const std::string& method, const std::string& controller, ReplayJob& job) {
  const Result<LocalizationKind> by = parse_replay_method(method);
  if (!by) return tl::unexpected(by.error());
  job.method = *by;
  Result<ReplayController> steered_by = parse_controller(controller);
  if (!steered_by) {
    steered_by.error().place.key = "--controller";
    return tl::unexpected(std::move(steered_by.error()));
  }
  job.replay.controller = *steered_by;
  if (job.replay.laps > 0 && job.replay.laps <= 1000) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside (0, 1000]", job.replay.laps),
              {.key = "--laps"});
}

Status check_recording(const ReplayJob& job, const RobotSetup& setup) {
  if (!job.images.empty() && job.output.empty())
    return fail(ErrorCode::InvalidArgument, "nothing is recorded", {.key = "--record-images"},
                "Add -o FILE.");
  return check_recorded_images(setup.may_have_pictures(), job.images);
}

Result<ReplayFiles> load_replay(const ReplayJob& job, const JobControl& control) {
  Result<MapFolder> folder = read_map_and_route(job.folder, job.route);
  if (!folder) return tl::unexpected(folder.error());
  Result<Trajectory> taught = taught_path(job, control);
  if (!taught) return tl::unexpected(taught.error());
  if (taught->empty() && !job.route.empty()) *taught = path_of(folder->route);
  return ReplayFiles{std::move(*folder), std::move(*taught)};
}

Status check_drive(const ReplayJob& job, const Route& route) {
  constexpr double kSlowest_m_s = 0.005;  // slower, a robot that drives cannot be told from one that stands
  const double speed_m_s = job.replay.profile.speed_m_s;
  if (speed_m_s > 0 && speed_m_s < kSlowest_m_s)
    return fail(ErrorCode::InvalidArgument, fmt::format("{:g} m/s are too slow to drive a route", speed_m_s),
                {.key = "--speed-m-s"},
                fmt::format("Give {:g} or more, or 0 for the speed that the route states.", kSlowest_m_s));
  if (route.closed || job.replay.laps == 1) return {};
  return fail(ErrorCode::InvalidArgument, "the route is open: it is driven once, from its start to its end",
              {.key = "--laps"}, "Leave --laps out, or teach a lap that comes back to its start.");
}

Status take_calibration(const std::string& path, ReplayJob& job) {
  if (path.empty()) return {};
  Result<Calibration> calibration = read_calibration(path);
  if (!calibration) return tl::unexpected(calibration.error());
  take_calibrated(*calibration, job.filter);
  // Both are shares of what was asked: wheels that are controlled turn as asked, the robot by the gain less.
  if (const auto gain = calibration->known("yaw_gain")) job.replay.actuators.turn_gain = *gain;
  job.calibration = std::move(*calibration);
  return {};
}

ReplayerSetup replayer_setup(const ReplayJob& job) {
  return {.method = job.method,
          .filter = job.filter,
          .anchor = job.anchor,
          .calibration = job.calibration,
          .replay = job.replay};
}

namespace {

std::string replay_options_yaml(const ReplayOptions& options) {
  return "follower:\n" + write_fields(options.follower, 2) + "actuators:\n" +
         write_fields(options.actuators, 2) + "profile:\n" + write_fields(options.profile, 2) + "pursuit:\n" +
         write_fields(options.pursuit, 2) + "goal:\n" + write_fields(options.goal, 2) + "watch:\n" +
         write_fields(options.watch, 2) + "consistency:\n" + write_fields(options.consistency, 2) +
         "safety:\n" + write_fields(options.safety, 2);
}

}  // namespace

Result<std::optional<SampleRecorder>> record_replay(const RobotSetup& setup, const ReplayJob& job) {
  if (job.output.empty()) return std::optional<SampleRecorder>();
  Result<SampleRecorder> recorder = start_recording(
      job.output,
      {.verb = "replay",
       .driver = std::string(to_string(job.replay.controller)),
       .options = fmt::format("replay:\n  method: {}\n  laps: {}\n", to_string(job.method), job.replay.laps) +
                  (job.method == LocalizationKind::Anchor ? "anchor:\n" + write_fields(job.anchor, 2)
                                                          : "filter:\n" + write_fields(job.filter, 2)) +
                  replay_options_yaml(job.replay),
       .durable = job.durable},
      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  for (const std::string& name :
       {std::string("map.yaml"), route_file_name(job.route)}) {  // what it was driven by
    const auto text = read_text_file(job.folder / name, kMostMapBytes);
    if (!text) return tl::unexpected(text.error());
    Status status = recorder->add_attachment(name, "application/yaml", {}, *text);
    if (!status) return tl::unexpected(status.error());
  }
  return std::optional<SampleRecorder>(std::move(*recorder));
}

double goal_m(const Route& route, const ReplayJob& job) {
  return route.length_m * (route.closed ? job.replay.laps : 1);
}

double time_allowed_s(const Route& route, const ReplayJob& job, const RobotModel& robot) {
  double speed_m_s = std::min(job.replay.safety.max_speed_m_s, robot.limits.speed_m_s);
  if (job.replay.profile.speed_m_s > 0) speed_m_s = std::min(speed_m_s, job.replay.profile.speed_m_s);
  double paused_s = 0;
  for (const Station& station : route.stations) paused_s += station.pause_s;
  if (route.closed) paused_s *= job.replay.laps;
  return 60 + goal_m(route, job) / std::min(0.05, speed_m_s / 3) + 3 * paused_s;
}

ReplayJob slowed(ReplayJob job, double most_m_s) {
  job.replay.safety.max_speed_m_s = std::min(job.replay.safety.max_speed_m_s, most_m_s);
  return job;
}

std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route, const RobotModel& robot) {
  const double most = job.replay.safety.max_speed_m_s;
  double asked = job.replay.profile.speed_m_s;
  for (const RoutePoint& point : route.points) {
    if (job.replay.profile.speed_m_s <= 0) asked = std::max(asked, std::abs(point.speed_m_s));
  }
  if (asked <= std::min(most, robot.limits.speed_m_s)) return {};
  if (robot.limits.speed_m_s < most)
    return {
        fmt::format("{:g} m/s are asked for, but {} drives at most {:g} m/s (limits: speed_m_s of its file)",
                    asked, robot.name, robot.limits.speed_m_s)};
  return {
      fmt::format("{:g} m/s are asked for, but the limiter lets no more than {:g} m/s pass (--max-speed-m-s)",
                  asked, most)};
}

namespace {

Result<ReplayReport> replay_simulated(const RobotSetup& setup, const ReplayJob& job,
                                      const JobControl& control) {
  const Stopwatch watch;
  const Result<ReplayFiles> loaded = load_replay(job, control);
  if (!loaded) return tl::unexpected(loaded.error());
  if (Status laps = check_drive(job, loaded->route); !laps) return tl::unexpected(laps.error());
  Result<std::optional<SampleRecorder>> recorder = record_replay(setup, job);
  if (!recorder) return tl::unexpected(recorder.error());
  const auto replayer = make_replayer(*loaded, setup.robot(), replayer_setup(job));
  if (!replayer) return tl::unexpected(replayer.error());
  const double goal = goal_m(loaded->route, job);
  const double allowed_s = time_allowed_s(loaded->route, job, setup.simulated.model);
  ReplayLog log(std::move(*recorder), job.images, goal, control);
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return log.on_sample(sample); };
  listener.on_step = [&](SensorTime now, const ReplayStep& step) { return log.on_step(now, step); };
  listener.should_stop = control.cancelled;
  const auto end = drive_replay(setup.simulated, **replayer, listener, {.timeout_s = allowed_s});
  const Status closed = log.close();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  ReplayReport report{.end = *end,
                      .route_length_m = loaded->route.length_m,
                      .true_path = std::move(log.true_path()),
                      .taught_path = loaded->taught,
                      .visits = log.visits(),
                      .warnings = speed_warnings(job, loaded->route, setup.simulated.model)};
  for (std::string& words : (*replayer)->problems()) report.warnings.push_back(std::move(words));
  report.allowed_s = allowed_s;
  judge(setup, report);
  report.wall_s = watch.seconds();
  return report;
}

}  // namespace

Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job, const JobControl& control) {
  for (const std::string& words : other_robot_words(setup, job.folder)) control.note(words);
  return setup.process.empty() ? replay_simulated(setup, job, control) : replay_process(setup, job, control);
}

}  // namespace waymark
