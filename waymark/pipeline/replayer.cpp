#include "waymark/pipeline/replayer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/replay/route_checks.hpp"
#include "waymark/replay/safety_limiter.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using State = ReplayState;
using Event = ReplayEvent;
using Action = ReplayAction;

struct Row {
  State from;
  Event event;
  ReplayTransition then;
};

/// All transitions; see the diagram in docs/concepts/replay.md. Any other event has no effect.
constexpr std::array kReplayTable{
    Row{State::Waiting, Event::GateOpen, {State::Driving, Action::BeginRoute}},
    Row{State::Waiting, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Refused, Event::Resume, {State::Waiting, Action::Nothing}},
    Row{State::Driving, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Driving, Event::GoalReached, {State::Finished, Action::Nothing}},
    Row{State::Driving, Event::EndReached, {State::Incomplete, Action::Nothing}},
    Row{State::Driving, Event::LimiterStops, {State::Stopped, Action::CountStop}},
    Row{State::Driving, Event::StationReached, {State::AtStation, Action::Nothing}},
    Row{State::AtStation, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::AtStation, Event::LimiterStops, {State::Stopped, Action::CountStop}},
    Row{State::AtStation, Event::LimiterAllows, {State::Driving, Action::Nothing}},
    Row{State::Stopped, Event::GateShut, {State::Refused, Action::Nothing}},
    Row{State::Stopped, Event::LimiterAllows, {State::Driving, Action::Nothing}},
    Row{State::Stopped, Event::StationReached, {State::AtStation, Action::Nothing}},
};

constexpr std::array<std::string_view, 3> kControllers{"follower", "pursuit", "pose"};

}  // namespace

std::vector<std::string> replay_controllers() { return {kControllers.begin(), kControllers.end()}; }

std::string_view to_string(ReplayController controller) {
  return kControllers[static_cast<std::size_t>(controller)];
}

Result<ReplayController> parse_controller(std::string_view name) {
  const auto* const found = std::ranges::find(kControllers, name);
  if (found != kControllers.end()) return static_cast<ReplayController>(found - kControllers.begin());
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown controller '{}'", name), {},
              suggestion(std::string(name), replay_controllers()));
}

std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event) {
  const auto* const row =
      std::ranges::find_if(kReplayTable, [&](const Row& r) { return r.from == from && r.event == event; });
  return row != kReplayTable.end() ? std::optional(row->then) : std::nullopt;
}

std::string_view to_string(ReplayState state) {
  constexpr std::array<std::string_view, 7> kWords{"waiting", "refused",  "driving",   "at a station",
                                                   "stopped", "finished", "incomplete"};
  return kWords[static_cast<std::size_t>(state)];
}

std::string_view to_string(ReplayEvent event) {
  constexpr std::array<std::string_view, 8> kWords{"gate open",       "gate shut",     "goal reached",
                                                   "end reached",     "limiter stops", "limiter allows",
                                                   "station reached", "resume"};
  return kWords[static_cast<std::size_t>(event)];
}

namespace {

constexpr double kUsualPeriod_s = 0.05;

double age_s(SensorTime now, const std::optional<SensorTime>& newest, double unless) {
  return newest ? to_seconds(now - *newest) : unless;
}

}  // namespace

Replayer::Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
                   const ReplayOptions& options)
    : method_(std::move(method)),
      route_(with_speed_profile(facing_along(std::move(route)), options.profile)),
      map_(std::move(map)),
      robot_(std::move(robot)),
      options_(options),
      predictor_(options.actuators),
      follower_(options.follower),
      stations_(route_),
      watch_(options.watch),
      consistency_(options.consistency, options.actuators, options.odometry) {}

void Replayer::add(const TagFrame& frame) {
  newest_image_ = frame.stamp;
  received_ = true;
  const bool mapped = std::ranges::any_of(frame.detections, [&](const TagDetection& seen) {
    return usable_corners(seen) && map_.find(seen.tag) != nullptr;
  });
  if (mapped && !reports_accepted_) accept(frame.stamp);
  if (watch_.add(frame)) method_->add(frame);
}

void Replayer::add(const TagPoseFrame& frame) {
  newest_image_ = frame.stamp;
  received_ = true;
  const bool mapped = std::ranges::any_of(
      frame.tags, [&](const SeenTagPose& seen) { return map_.find(seen.tag) != nullptr; });
  if (mapped && !reports_accepted_) accept(frame.stamp);
  if (watch_.add(frame)) method_->add(frame);
}

void Replayer::add(const Odometry& odometry) {
  received_ = true;
  method_->add(odometry);
  watch_.add(odometry);
  consistency_.add(odometry);
  newest_odometry_ = odometry.stamp;
}

void Replayer::add(const ImuSample& imu) {
  received_ = true;
  method_->add(imu);
  consistency_.add(imu);
  newest_gyro_ = imu.stamp;
}

void Replayer::add(const LaserScan& scan) { scan_ = scan; }

void Replayer::accept(SensorTime stamp) {
  newest_accepted_ = stamp;
  accepted_path_m_ = consistency_.path_m();
}

void Replayer::pause(std::string reason) { pause_ = std::move(reason); }

void Replayer::restart_from(const GivenPose& given) {
  given_ = method_->restart_from(given);
  pause(given_ ? "its pose was given. Check the robot, then resume"
               : "a pose was given, but this method does not accept one. Check the robot, then resume");
}

void Replayer::resume() {
  pause_.clear();
  watch_.forget();
  consistency_.forget();
  contradiction_.clear();
  silence_.clear();
  silent_s_ = 0;
  follower_.reset();
  last_step_.reset();
  if (progress_) find_ahead_ = true;
  handle(ReplayEvent::Resume);
}

/// This is the only function that changes the state.
void Replayer::handle(ReplayEvent event) {
  const std::optional<ReplayTransition> then = transition(state_, event);
  if (!then) return;
  state_ = then->to;
  if (then->action == ReplayAction::CountStop) ++stops_;
  if (then->action == ReplayAction::BeginRoute) stations_.begin(way_m());
}

void Replayer::track(const LocalizationEstimate& estimate) {
  if (!progress_) {
    progress_ = locate(route_, estimate.map_T_base);
    start_way_m_ = progress_->arc_length_m;
    return;
  }
  const double before = progress_->arc_length_m;
  const bool goes_on = find_ahead_;
  if (find_ahead_) {
    constexpr double kBehind = 0.1;
    progress_ = locate(route_, estimate.map_T_base, route_.closed ? 0 : before - kBehind);
    find_ahead_ = false;
    if (state_ != ReplayState::Waiting) pass_start_gate();
  } else {
    progress_ = advance(route_, estimate.map_T_base, *progress_);
  }
  double moved = progress_->arc_length_m - before;
  if (route_.closed) moved = std::remainder(moved, route_.length_m);
  driven_m_ += moved;
  if (goes_on) skipped_m_ += std::max(0.0, moved);
  if (goes_on) stations_.begin(way_m());
  if (state_ == ReplayState::Driving) follower_.integrate(*progress_, moved);
}

/// Lets the replay start only near the route and in its direction; otherwise reports where to place the
/// robot.
void Replayer::pass_start_gate() {
  const auto refusal = start_refusal(progress_->cross_track_m, progress_->heading_error_rad, options_.safety);
  if (!refusal) return handle(ReplayEvent::GateOpen);
  const SE2& there = progress_->map_T_route;
  refusal_ = fmt::format("{} (nearest pose in map: x {:.2f} m, y {:.2f} m, heading {:.0f} deg)", *refusal,
                         there.x(), there.y(), to_degrees(there.yaw()));
  handle(ReplayEvent::GateShut);
}

double Replayer::remaining_m(const RouteProgress& at) const {
  double ahead = progress_ ? at.arc_length_m - progress_->arc_length_m : 0.0;
  if (route_.closed) ahead = std::remainder(ahead, route_.length_m);
  const double station_m = stations_.left_m(way_m() + ahead);
  if (at.leg_end_m < route_.length_m || at.leg_begin_m > 0)
    return std::min(station_m, at.leg_end_m - at.arc_length_m);
  if (!route_.closed) return std::min(station_m, route_.length_m - at.arc_length_m);
  return std::min(station_m, options_.laps * route_.length_m - driven_m_ - ahead);
}

/// For controllers that do not stop at stations themselves.
VelocityCommand Replayer::slow_for_station(VelocityCommand command) const {
  const double left = stations_.left_m(way_m()) - options_.follower.stop_within_m;
  const double most = std::max(0.05, std::sqrt(std::max(0.0, 2 * options_.follower.brake_m_s2 * left)));
  const double share = std::min(1.0, most / std::max(std::abs(command.speed_m_s), 1e-6));
  return {share * command.speed_m_s, share * command.yaw_rate_rad_s};
}

bool Replayer::at_goal() const {
  if (route_.closed) return driven_m_ >= options_.laps * route_.length_m - options_.follower.stop_within_m;
  return progress_->arc_length_m >= route_.length_m - options_.follower.stop_within_m;
}

/// Length of the route before the start, plus the parts that resume() skipped.
double Replayer::left_out_m() const { return skipped_m_ + (route_.closed ? 0.0 : start_way_m_); }

/// If no sensor sample arrived for more than one second, or this computer was suspended, the motion during
/// that time is unknown, and the operator has to check the robot.
void Replayer::notice_silence(double dt_s) {
  constexpr double kMaxSilence_s = 1.0;
  if (dt_s > kMaxSilence_s && state_ != ReplayState::Waiting)
    silence_ = fmt::format(
        "no command was sent for {:.1f} s: this computer was overloaded. Check the robot, then resume", dt_s);
  silent_s_ = std::exchange(received_, false) ? 0.0 : silent_s_ + std::clamp(dt_s, 0.0, 0.5);
  if (silent_s_ > kMaxSilence_s && state_ != ReplayState::Waiting)
    silence_ =
        fmt::format("no sensor sample for {:.1f} s or more. Check the robot, then resume", kMaxSilence_s);
}

VelocityCommand Replayer::steer(SensorTime now, const LocalizationEstimate& estimate) {
  if (options_.controller == ReplayController::Pursuit)
    return slow_for_station(pure_pursuit(route_, estimate.map_T_base, *progress_, options_.pursuit));
  if (options_.controller == ReplayController::Pose)
    return slow_for_station(go_to_pose(route_, estimate.map_T_base, *progress_, options_.goal));
  const PredictedMotion then = predictor_.predict(predictor_.acts_at(now));
  const RouteProgress at = advance(route_, then.map_T_base, *progress_);
  return follower_.follow(route_, then, at, remaining_m(at), predictor_.options(), predictor_.turning());
}

/// Reasons to stop that are not detected by the limiter itself.
std::string Replayer::alarm() const {
  if (!pause_.empty()) return pause_;
  if (!contradiction_.empty()) return contradiction_;
  if (!watch_.alarm().empty()) return watch_.alarm();
  if (!silence_.empty()) return silence_;
  if (!lost_certainty_) return {};
  if (given_)
    return "observed tags do not confirm the given pose. Set it again, or place the robot where two tags are "
           "in "
           "view";
  std::string reason = "observed tags contradict the estimated pose. Was the robot moved by hand?";
  const std::vector<std::string> problems = method_->problems();
  if (!problems.empty()) reason += " (" + problems.front() + ")";
  return reason;
}

SafetyInputs Replayer::inputs_of(SensorTime now, const std::optional<LocalizationEstimate>& estimate,
                                 const VelocityCommand& wanted) const {
  SafetyInputs inputs{.last = last_command_, .alarm = alarm()};
  inputs.odometry_age_s = age_s(now, newest_odometry_, std::numeric_limits<double>::infinity());
  inputs.gyro_age_s = age_s(now, newest_gyro_, 0);
  inputs.image_age_s = age_s(now, newest_image_, 0);
  inputs.blind_m = newest_accepted_ ? consistency_.path_m() - accepted_path_m_ : 0.0;
  inputs.taught_blind_m = route_.longest_without_tags_m.value_or(0);
  if (inputs.blind_m > inputs.taught_blind_m) inputs.missed = describe(missed_);
  if (scan_) {
    inputs.scan_age_s = to_seconds(now - scan_->stamp);
    const double curvature = std::abs(wanted.speed_m_s) > 1e-3
                                 ? predictor_.turning().gain * wanted.yaw_rate_rad_s / wanted.speed_m_s
                                 : 0.0;
    inputs.obstacle_m =
        free_way_m(*scan_, options_.base_T_lidar, robot_.hull, curvature, wanted.speed_m_s < 0);
  }
  if (!estimate) return inputs;
  inputs.localized = true;
  inputs.position_sigma_m = estimate->position_sigma_m();
  inputs.contradicting_frames = estimate->contradicting_frames;
  inputs.unsure = unsure_;
  inputs.cross_track_m = progress_->cross_track_m;
  inputs.clearance_m = clearance_m(robot_.hull, lift(estimate->map_T_base), map_);
  return inputs;
}

void Replayer::drive(SensorTime now, double dt_s, ReplayStep& step) {
  VelocityCommand wanted{};
  if (step.estimate && stations_.current() == nullptr) wanted = steer(now, *step.estimate);
  SafetyInputs inputs = inputs_of(now, step.estimate, wanted);
  inputs.dt_s = dt_s;
  const SafetyVerdict verdict = limit(wanted, inputs, options_.safety);
  step.command = last_command_ = verdict.command;
  unsure_ = verdict.unsure;
  step.reason = verdict.stopped;
  if (verdict.stopped)
    step.lasting = watch_.lasting() || !contradiction_.empty() || !silence_.empty() || !pause_.empty();
  const bool at_station = stations_.current() != nullptr;
  handle(verdict.stopped ? ReplayEvent::LimiterStops
         : at_station    ? ReplayEvent::StationReached
                         : ReplayEvent::LimiterAllows);
  if (state_ == ReplayState::AtStation) serve_station(dt_s, step);
}

/// The dwell time starts when the robot has come to a standstill.
void Replayer::serve_station(double dt_s, ReplayStep& step) {
  step.station = *stations_.current();
  step.reason = fmt::format("at '{}': continues in {:.1f} s", step.station->name, stations_.left_s());
  if (last_command_ == VelocityCommand{}) stations_.dwell(std::clamp(dt_s, 0.0, 0.5));
}

/// A higher certainty is required at the start than during the drive.
bool Replayer::certain(const std::optional<LocalizationEstimate>& estimate) const {
  if (!estimate || !estimate->certain) return false;
  return state_ != ReplayState::Waiting ||
         estimate->position_sigma_m() <= options_.safety.stop_position_sigma_m;
}

void Replayer::follow_estimate(const LocalizationEstimate& estimate) {
  // The estimate jumps after a data feed has been stuck; the contradiction found first is more informative.
  if (contradiction_.empty()) watch_.check(estimate.map_T_base);
  predictor_.observe(estimate.stamp, estimate.map_T_base, state_ == ReplayState::Driving);
  track(estimate);
  if (state_ == ReplayState::Waiting) pass_start_gate();
  if (state_ != ReplayState::Driving) return;
  if (at_goal())
    return handle(left_out_m() <= options_.safety.start_distance_m ? ReplayEvent::GoalReached
                                                                   : ReplayEvent::EndReached);
  stations_.arrive(way_m(), options_.follower.stop_within_m);
}

/// Compares commands, wheels, gyro and tags.
void Replayer::compare_motion(const ReplayStep& step, double dt_s) {
  constexpr double kMoment_s = 0.3;
  for (const NisRecord& record : step.compared) {
    reports_accepted_ = true;
    if (record.accepted) accept(record.stamp);
  }
  consistency_.command(last_command_, dt_s);
  if (step.estimate) {
    const LocalizationEstimate& estimate = *step.estimate;
    const bool tags =
        reports_accepted_ && newest_accepted_ && to_seconds(estimate.stamp - *newest_accepted_) < kMoment_s;
    consistency_.observe(estimate.map_T_base, estimate.covariance, tags);
  } else {
    consistency_.observe_nothing();
  }
  if (const auto fix = method_->tag_fix(); fix && fix->stamp != newest_fix_) {
    newest_fix_ = fix->stamp;
    consistency_.observe_image(fix->stamp, fix->map_T_base, fix->covariance,
                               newest_accepted_ && *newest_accepted_ >= fix->stamp);
  }
  if (state_ == ReplayState::Waiting || !contradiction_.empty()) return;
  if (const auto found = consistency_.contradiction()) contradiction_ = describe(*found);
}

ReplayStep Replayer::step(SensorTime now) {
  ReplayStep step{.estimate = method_->estimate(), .compared = method_->comparisons()};
  method_->clear_comparisons();
  const bool known = certain(step.estimate);
  lost_certainty_ = was_certain_ && !known;
  was_certain_ = was_certain_ || known;
  given_ = given_ && !known;
  if (!known) step.estimate.reset();  // an uncertain estimate must not be used for driving
  watch_.tick(now);
  const double dt_s = last_step_ ? to_seconds(now - *last_step_) : kUsualPeriod_s;
  last_step_ = now;
  notice_silence(dt_s);
  compare_motion(step, dt_s);
  if (step.estimate && is_live(state_)) follow_estimate(*step.estimate);
  if (step.estimate) step.progress = progress_;
  if (is_live(state_)) {
    drive(now, dt_s, step);
  } else {
    last_command_ = {};
    if (state_ == ReplayState::Refused) step.reason = refusal_;
    if (state_ == ReplayState::Incomplete)
      step.reason = fmt::format("at the end of the route, but {:.2f} m of {:.2f} m were not driven",
                                left_out_m(), route_.length_m);
  }
  predictor_.sent(now, last_command_);
  step.state = state_;
  step.driven_m = driven_m_;
  step.turn_gain = predictor_.turning().gain;
  return step;
}

}  // namespace waymark
