#include "waymark/app/replay/replay_route.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/app/replay/robot_difference.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/replay/route_checks.hpp"

namespace waymark {
namespace {

ros2::DiagnosticArray message_of(SensorTime now, const ReplayStep& step) {
  constexpr std::uint8_t kOk = 0;
  constexpr std::uint8_t kWarn = 1;
  const bool halted = step.state == ReplayState::Stopped || step.state == ReplayState::Refused;
  ros2::DiagnosticArray message;
  message.header = {.stamp = ros2::to_ros(now), .frame_id = std::string(ros2::kMapFrame)};
  ros2::DiagnosticStatus status{.level = halted ? kWarn : kOk, .name = "waymark replay"};
  status.message = std::string(to_string(step.state));
  if (step.reason) status.message += ": " + *step.reason;
  status.values.push_back({"driven_m", fmt::format("{:.3f}", step.driven_m)});
  if (step.station) status.values.push_back({"station", step.station->name});
  message.status.push_back(std::move(status));
  return message;
}

}  // namespace

void ReplayNotes::note_station(SensorTime now, const ReplayStep& step) {
  if (last_ == ReplayState::AtStation) {
    if (step.state != ReplayState::Stopped)
      control_.note(fmt::format("leaves station '{}'", visits_.back().name));
  }
  if (step.state != ReplayState::AtStation) return;
  const Station& station = *step.station;
  visits_.push_back({.name = station.name, .arc_length_m = station.arc_length_m, .arrived = now});
  control_.note(fmt::format("at station '{}', {:.2f} m along the route, for {:g} s", station.name,
                            station.arc_length_m, station.pause_s));
}

Status ReplayNotes::add(SensorTime now, const ReplayStep& step, SampleRecorder* recorder) {
  const std::string station = step.station ? step.station->name : std::string();
  if (last_ == ReplayState::AtStation) visits_.back().dwell_s = to_seconds(now - visits_.back().arrived);
  if (last_ == step.state && station == last_station_) return {};
  note_station(now, step);
  last_ = step.state;
  last_station_ = station;
  return recorder != nullptr ? recorder->add_message(topics::kDiagnostics, now, message_of(now, step))
                             : Status();
}

Status ReplayLog::on_sample(const Sample& sample) {
  if (const auto* truth = std::get_if<TruthPose>(&sample))
    true_path_.push_back({truth->stamp, truth->map_T_base});
  if (!recorder_) return {};
  if (const auto* image = std::get_if<CameraFrame>(&sample)) return record_image(*image, images_, *recorder_);
  return recorder_->add(sample);
}

Status ReplayLog::on_step(SensorTime now, const ReplayStep& step) {
  if (Status status = notes_.add(now, step, recorder_ ? &*recorder_ : nullptr); !status) return status;
  control_.progress(
      {.text = fmt::format("{:.1f} of {:.1f} m{}{}. Space or Ctrl-C stops the robot.", step.driven_m, goal_m_,
                           step.reason ? ", stopped: " : "", step.reason.value_or(""))});
  if (!recorder_ || !step.estimate) return {};
  return recorder_->add_message(topics::kEstimate, now, estimate_message(*step.estimate));
}

ReplayListener ReplayLog::listener() {
  return {.on_sample = [this](const Sample& sample) { return on_sample(sample); },
          .on_step = [this](SensorTime now, const ReplayStep& step) { return on_step(now, step); }};
}

Status ReplayLog::close() { return recorder_ ? recorder_->close() : Status(); }

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMapBytes = std::size_t{1} << 26U;

/// The reference path for a route without a lap: the route itself and, if it is closed, the first tenth of it
/// again.
Trajectory path_of(const Route& route) {
  Trajectory path;
  const std::size_t beyond = route.closed ? route.points.size() / 10 : 0;
  for (std::size_t i = 0; i < route.points.size() + beyond; ++i)
    path.push_back(
        {SensorTime(std::chrono::milliseconds(i)), lift(route.points[i % route.points.size()].map_T_base)});
  return path;
}

/// The true path of the teach lap; empty if it is unknown.
Result<Trajectory> taught_path(const ReplayJob& job, const JobControl& control) {
  if (!job.taught.empty()) {
    Result<RecordedLap> lap = read_lap_file(job.taught, silent(control));
    if (!lap) return tl::unexpected(lap.error());
    if (affects(lap->other_clock, StampedKind::Truth)) {
      lap->other_clock->error.place.source = job.taught;
      return tl::unexpected(lap->other_clock->error);
    }
    if (lap->truth.empty())
      return fail(ErrorCode::NotFound, "this recording contains no ground truth", {.source = job.taught});
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
        "not evaluated: the true path of the teach lap is unknown (give its recording with `taught`)");
    return;
  }
  const Result<ReplayJudgement> judgement = judge_replay(
      report.true_path, report.taught_path, setup.simulated.world.tags, setup.simulated.model.hull);
  if (judgement)
    report.judgement = *judgement;
  else
    report.warnings.push_back("not evaluated: " + to_string(judgement.error()));
}

Result<LocalizationKind> parse_replay_method(const std::string& name) {
  std::vector<std::string> methods = localization_methods();
  std::erase(methods, to_string(LocalizationKind::Smoother));
  if (std::ranges::find(methods, name) != methods.end()) return parse_localization_method(name);
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown method '{}'", name), {.key = "method"},
              suggestion(name, methods));
}

Status choose_replay(const std::string& method, const std::string& controller, ReplayJob& job) {
  const Result<LocalizationKind> by = parse_replay_method(method);
  if (!by) return tl::unexpected(by.error());
  job.method = *by;
  Result<ReplayController> steered_by = parse_controller(controller);
  if (!steered_by) {
    steered_by.error().place.key = "controller";
    return tl::unexpected(std::move(steered_by.error()));
  }
  job.replay.controller = *steered_by;
  if (job.replay.laps > 0 && job.replay.laps <= 1000) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside (0, 1000]", job.replay.laps),
              {.key = "laps"});
}

Status check_recording(const ReplayJob& job, const RobotSetup& setup) {
  if (!job.images.empty() && job.output.empty())
    return fail(ErrorCode::InvalidArgument, "needs a recording", {.key = "record_images"},
                "Add `output=FILE`.");
  return check_recorded_images(setup.may_have_images(), job.images);
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
  constexpr double kMinSpeed_m_s = 0.005;  // a slower robot cannot be distinguished from a stationary one
  const double speed_m_s = job.replay.profile.speed_m_s;
  if (speed_m_s > 0 && speed_m_s < kMinSpeed_m_s)
    return fail(ErrorCode::InvalidArgument, fmt::format("{:g} m/s is too slow for a route", speed_m_s),
                {.key = "speed_m_s"},
                fmt::format("Use at least {:g}, or 0 for the speed of the route.", kMinSpeed_m_s));
  if (route.closed || job.replay.laps == 1) return {};
  return fail(ErrorCode::InvalidArgument, "an open route is driven once, from its start to its end",
              {.key = "laps"}, "Omit `laps`, or teach a lap that returns to its start.");
}

Status take_calibration(const std::string& path, ReplayJob& job) {
  if (path.empty()) return {};
  Result<Calibration> calibration = or_wrong_kind(read_calibration(path), path, FileUse::Calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  take_calibrated(*calibration, job.filter);
  // Both are ratios to the commanded yaw rate. Controlled wheels turn as commanded, whereas the robot turns
  // less by this gain.
  if (const auto gain = calibration->observable_value("yaw_scale")) job.replay.actuators.turn_gain = *gain;
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
       {std::string("map.yaml"), route_file_name(job.route)}) {  // the input files of the replay
    const auto text = read_text_file(job.folder / name, kMaxMapBytes);
    if (!text) return tl::unexpected(text.error());
    Status status = recorder->add_attachment(name, "application/yaml", {}, *text);
    if (!status) return tl::unexpected(status.error());
  }
  return std::optional<SampleRecorder>(std::move(*recorder));
}

void note_near_tags(const MapFolder& folder, const RobotModel& robot, const ReplayJob& job,
                    const JobControl& control) {
  const auto nearest = nearest_tag(folder.route, folder.map.tags, robot.hull);
  const std::string words = nearest ? describe_too_near(*nearest, job.replay.safety) : std::string();
  if (!words.empty()) control.note("warning: " + words);
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

ReplayJob slowed(ReplayJob job, double max_speed_m_s) {
  job.replay.safety.max_speed_m_s = std::min(job.replay.safety.max_speed_m_s, max_speed_m_s);
  return job;
}

std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route, const RobotModel& robot) {
  const double most = job.replay.safety.max_speed_m_s;
  double requested = job.replay.profile.speed_m_s;
  for (const RoutePoint& point : route.points) {
    if (job.replay.profile.speed_m_s <= 0) requested = std::max(requested, std::abs(point.speed_m_s));
  }
  if (requested <= std::min(most, robot.limits.speed_m_s)) return {};
  if (robot.limits.speed_m_s < most)
    return {fmt::format("requested {:g} m/s, but the limit of {} is {:g} m/s (limits: speed_m_s in its file)",
                        requested, robot.name, robot.limits.speed_m_s)};
  return {fmt::format("requested {:g} m/s, but the limiter allows at most {:g} m/s (`max_speed_m_s`)",
                      requested, most)};
}

namespace {

Result<ReplayReport> replay_simulated(const RobotSetup& setup, const ReplayJob& job,
                                      const JobControl& control) {
  const Stopwatch watch;
  const Result<ReplayFiles> loaded = load_replay(job, control);
  if (!loaded) return tl::unexpected(loaded.error());
  if (Status laps = check_drive(job, loaded->route); !laps) return tl::unexpected(laps.error());
  const auto replayer = make_replayer(*loaded, setup.robot(), replayer_setup(job));
  if (!replayer) return tl::unexpected(replayer.error());
  Result<std::optional<SampleRecorder>> recorder = record_replay(setup, job);
  if (!recorder) return tl::unexpected(recorder.error());
  note_near_tags(*loaded, setup.simulated.model, job, control);
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

namespace {

/// Adds the tags of the map to the setup if its world is unknown. They are needed for the recording and the
/// evaluation.
RobotSetup with_map_tags(const RobotSetup& setup, const MapFile& map) {
  RobotSetup extended = setup;
  for (const auto& [tag, mapped] : map.tags.tags) extended.known_tags.push_back(tag);
  if (extended.world_yaml.empty()) {
    extended.simulated.world.anchor = map.anchor;
    extended.simulated.world.tags = map.tags;
  }
  return extended;
}

}  // namespace

Result<std::unique_ptr<LiveReplay>> LiveReplay::make(const RobotSetup& setup, const ReplayJob& job,
                                                     const ReplayFiles& files, const JobControl& control,
                                                     std::function<void(const ReplayStep&)> on_step,
                                                     SessionRequests requests) {
  std::unique_ptr<LiveReplay> live(new LiveReplay(with_map_tags(setup, files.map), files));
  auto replayer = make_replayer(files, setup.robot(), replayer_setup(job));
  if (!replayer) return tl::unexpected(replayer.error());
  auto recorder = record_replay(live->setup_, job);
  if (!recorder) return tl::unexpected(recorder.error());
  live->replayer_ = std::move(*replayer);
  live->log_ =
      std::make_unique<ReplayLog>(std::move(*recorder), job.images, goal_m(files.route, job), control);
  ReplayListener listener = live->log_->listener();
  listener.on_step = [log = live->log_.get(), shown = std::move(on_step)](SensorTime now,
                                                                          const ReplayStep& step) {
    shown(step);
    return log->on_step(now, step);
  };
  listener.on_message = control.note;
  live->session_ = std::make_unique<ReplaySession>(*live->replayer_, std::move(listener),
                                                   ReplaySessionOptions{}, std::move(requests));
  return live;
}

Result<ReplayReport> LiveReplay::finish(const ReplayEnd& end) {
  if (Status closed = log_->close(); !closed) return tl::unexpected(closed.error());
  ReplayReport report{.end = end,
                      .route_length_m = files_.route.length_m,
                      .true_path = std::move(log_->true_path()),
                      .taught_path = files_.taught,
                      .visits = log_->visits(),
                      .warnings = replayer_->problems()};
  if (report.true_path.empty())
    report.warnings.emplace_back("not evaluated: there is no ground truth of the replay");
  else
    judge(setup_, report);
  return report;
}

namespace {

/// Implements replay_route() for a robot process.
Result<ReplayReport> replay_process(const RobotSetup& setup, const ReplayJob& job,
                                    const JobControl& control) {
  const Stopwatch watch;
  const Result<ReplayFiles> files = load_replay(job, control);
  if (!files) return tl::unexpected(files.error());
  if (Status laps = check_drive(job, files->route); !laps) return tl::unexpected(laps.error());
  // Before the robot is started, which LiveReplay::make() would be too late for.
  if (Status drivable = check_drivable(*files); !drivable) return tl::unexpected(drivable.error());
  note_near_tags(*files, setup.simulated.model, job, control);
  PhaseViewers viewers(job.feed, setup.simulated, OperatorState::Replaying);
  const auto robot = LiveRobot::open(with_map_tags(setup, files->map), control);
  if (!robot) return tl::unexpected(robot.error());
  const auto replay =
      LiveReplay::make(setup, slowed(job, (*robot)->speed_limit_m_s()), *files, control,
                       viewers.viewers().watch(goal_m(files->route, job)), viewers.requests());
  if (!replay) return tl::unexpected(replay.error());
  FreshFile fresh(job.output);
  viewers.viewers().show_map(job.folder);
  ReplaySession& session = (*replay)->session();
  RobotListener listener = session.listener();
  listener.on_sample = [&](const Sample& sample) {
    fresh.receive(sample);
    return session.receive(sample);
  };
  const auto driven = (*robot)->drive(watched(std::move(listener), job.feed, control));
  const ReplayEnd end = driven ? session.end(*driven) : session.end();
  Result<ReplayReport> report = (*replay)->finish(end);
  if (!driven) return tl::unexpected(driven.error());
  if (!report) return report;
  for (std::string& words : speed_warnings(job, files->route, setup.simulated.model))
    report->warnings.push_back(std::move(words));
  report->wall_s = watch.seconds();
  return report;
}

}  // namespace

Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job, const JobControl& control) {
  for (const std::string& words : robot_difference_warnings(setup, job.folder)) control.note(words);
  return setup.process.empty() ? replay_simulated(setup, job, control) : replay_process(setup, job, control);
}

namespace {

/// "stopped 2 m along a route: a stick was moved", but "stopped by the operator 2 m along a route".
std::string stopped_where(const std::string& where, const std::string& reason) {
  constexpr std::string_view kState = "stopped: ";
  if (reason.starts_with("stopped ")) return reason + " " + where;
  return fmt::format("stopped {}: {}", where,
                     reason.starts_with(kState) ? reason.substr(kState.size()) : reason);
}

}  // namespace

std::string with_reason(std::string_view state, std::string_view reason) {
  if (reason.empty()) return std::string(state);
  if (reason.starts_with(state)) return std::string(reason);
  return fmt::format("{}: {}", state, reason);
}

std::string ending(const ReplayReport& report, std::string_view stopped_by) {
  const ReplayEnd& end = report.end;
  const double driven_m = std::round(100 * report.end.driven_m) / 100 + 0.0;  // avoids printing "-0.00" for a
                                                                              // small backward motion
  const std::string where =
      fmt::format("{:.2f} m along a route of {:.2f} m", driven_m, report.route_length_m);
  if (end.finished) return "the route was driven to its end";
  if (end.interrupted) return fmt::format("stopped by {} {}; the robot is stationary", stopped_by, where);
  if (end.state == ReplayState::Refused) return "refused to start: " + end.reason;
  if (end.state == ReplayState::Waiting && end.frames == 0)
    return "the pose was never certain: no camera frames arrived. Does the robot send images or tags? A "
           "camera "
           "of this computer is set with `camera_source`";
  if (end.state == ReplayState::Waiting)
    return end.frames_with_two_tags > 0 ? "the pose was never certain: the observed tags contradict the map. "
                                          "Is it the map of this place?"
                                        : "the pose was never certain: no frame contains two map tags";
  if (!end.reason.empty()) return stopped_where(where, end.reason);
  return fmt::format("aborted after {:.0f} s of simulated time, {}", report.allowed_s, where);
}

namespace {

/// Counts observations, not tags: at 20 Hz, a tag that is covered for one second counts 20 times.
std::string missed_text(const ReplayEnd& end) {
  int all = 0;
  for (const auto& [reason, count] : end.missed_tags) all += count;
  if (all == 0) return {};
  return fmt::format("expected tags that were not detected: {} ({})", all, counted_reasons(end.missed_tags));
}

ReportFields missed_fields(const ReplayEnd& end) {
  const auto count = [&](MissReason reason) {
    const auto found = end.missed_tags.find(reason);
    return found == end.missed_tags.end() ? 0 : found->second;
  };
  return {{"outside", "Outside the image", count(MissReason::Outside)},
          {"too_faint", "Too little contrast", count(MissReason::TooFaint)},
          {"blurred", "Blurred", count(MissReason::Blurred)},
          {"occluded", "Covered, or not at the expected position", count(MissReason::Occluded)}};
}

}  // namespace

std::string to_text(const ReplayReport& report, std::string_view stopped_by) {
  const ReplayEnd& end = report.end;
  std::string text =
      fmt::format("{}; {:.1f} s, {}\n", ending(report, stopped_by), end.lap_s, counted(end.stops, "stop"));
  for (const StationVisit& visit : report.visits)
    text += fmt::format("stopped at station '{}', {:.2f} m along the route, for {:.1f} s\n", visit.name,
                        visit.arc_length_m, visit.dwell_s);
  if (end.frames > 0)
    text += fmt::format("two or more tags in view {:.1f} % of the time\n",
                        100.0 * end.frames_with_two_tags / end.frames);
  if (const std::string missed = missed_text(end); !missed.empty()) text += missed + "\n";
  if (!report.judgement) return text;
  const ReplayJudgement& j = *report.judgement;
  return text + fmt::format(
                    "by ground truth: {} completed, {:.2f} m driven\n"
                    "  cross-track error    {:.3f} m rmse, {:.3f} m 95 %, {:.3f} m max\n"
                    "  heading error        {:.2f} deg rmse\n"
                    "  nearest tag          {:.3f} m from the hull\n",
                    counted(j.laps_completed, "lap"), j.distance_m, j.cross_track_rmse_m, j.cross_track_p95_m,
                    j.cross_track_max_m, j.heading_rmse_deg, j.min_clearance_m);
}

bool succeeded(const ReplayReport& report) { return report.end.finished; }

ReportFields fields(const StationVisit& visit) {
  return {{"name", "Name of the station", visit.name},
          {"arc_length_m", "Position along the route", visit.arc_length_m},
          {"arrived_s", "Time of arrival by the robot's clock", to_seconds(visit.arrived.time_since_epoch())},
          {"stationary_s", "Time from arrival to departure", visit.dwell_s}};
}

ReportFields fields(const ReplayReport& report) {
  const ReplayEnd& end = report.end;
  const std::optional<ReplayJudgement>& judged = report.judgement;
  const double two_tags = end.frames > 0 ? static_cast<double>(end.frames_with_two_tags) / end.frames : 0.0;
  return {
      {"laps_completed", "Whole laps along the taught path", part(judged, &ReplayJudgement::laps_completed)},
      {"finished", "Whether the robot drove all requested laps", end.finished},
      {"reason", "Why the robot did not drive to the end; empty otherwise", end.reason},
      {"cross_track_rmse_m",
       "Distance of the base from the true path of the taught lap (or the route), root mean square",
       part(judged, &ReplayJudgement::cross_track_rmse_m)},
      {"cross_track_p95_m", "95th percentile of this distance",
       part(judged, &ReplayJudgement::cross_track_p95_m)},
      {"cross_track_max_m", "Largest of these distances", part(judged, &ReplayJudgement::cross_track_max_m)},
      {"heading_rmse_deg", "Heading relative to the taught heading at the nearest point, root mean square",
       part(judged, &ReplayJudgement::heading_rmse_deg)},
      {"min_clearance_m", "3D distance from the hull to the nearest tag",
       part(judged, &ReplayJudgement::min_clearance_m)},
      {"two_tags_fraction", "Share of the frames with two or more tags", two_tags},
      {"missed_tags", "Tags expected from map and pose but not detected, in all images that Waymark searches",
       missed_fields(end)},
      {"stops", "How often the limiter stopped the robot", end.stops},
      {"distance_m", "Driven distance", part(judged, &ReplayJudgement::distance_m)},
      {"lap_s", "Duration of the replay by the robot's clock", end.lap_s},
      {"stations", "One entry per stop at a station", report.visits},
      {"wall_s", "Duration of the run", report.wall_s},
      {"warnings", "Warnings about the replay, one sentence each", report.warnings}};
}

}  // namespace waymark
