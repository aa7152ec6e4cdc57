#include "waymark/pipeline/replayer.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {

Replayer::Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
                   const ReplayOptions& options)
    : method_(std::move(method)),
      route_(std::move(route)),
      map_(std::move(map)),
      robot_(std::move(robot)),
      options_(options) {}

void Replayer::add(const TagFrame& frame) { method_->add(frame); }

void Replayer::add(const Odometry& odometry) {
  method_->add(odometry);
  newest_odometry_ = odometry.stamp;
}

void Replayer::track(const LocalizationEstimate& estimate) {
  if (!progress_) {
    progress_ = locate(route_, estimate.map_T_base);
    return;
  }
  const double before = progress_->arc_length_m;
  progress_ = advance(route_, estimate.map_T_base, *progress_);
  double moved = progress_->arc_length_m - before;
  if (route_.closed) moved = std::remainder(moved, route_.length_m);
  driven_m_ += moved;
}

bool Replayer::at_goal() const {
  if (route_.closed) return driven_m_ >= options_.laps * route_.length_m;
  return progress_->arc_length_m >= route_.length_m - 1e-3;
}

ReplayStep Replayer::step(SensorTime now) {
  ReplayStep step{.state = state_, .estimate = method_->estimate(), .driven_m = driven_m_};
  if (step.estimate && !step.estimate->certain) step.estimate.reset();  // a guess drives no wheels
  const double dt_s = last_step_ ? to_seconds(now - *last_step_) : 0.05;
  last_step_ = now;
  if (state_ == ReplayState::Finished || state_ == ReplayState::Refused) {
    if (state_ == ReplayState::Refused) step.reason = refusal_;
    return step;
  }
  if (step.estimate) {
    track(*step.estimate);
    step.progress = progress_;
    step.driven_m = driven_m_;
    if (state_ == ReplayState::Waiting) {
      const auto refusal =
          start_refusal(progress_->cross_track_m, progress_->heading_error_rad, options_.safety);
      state_ = refusal ? ReplayState::Refused : ReplayState::Driving;
      if (refusal) refusal_ = *refusal;
    }
    if (state_ == ReplayState::Driving && at_goal()) state_ = ReplayState::Finished;
    if (state_ == ReplayState::Refused || state_ == ReplayState::Finished) {
      last_command_ = {};
      step.state = state_;
      if (state_ == ReplayState::Refused) step.reason = refusal_;
      return step;
    }
  }

  SafetyInputs inputs{.dt_s = dt_s, .last = last_command_};
  inputs.odometry_age_s =
      newest_odometry_ ? to_seconds(now - *newest_odometry_) : std::numeric_limits<double>::infinity();
  VelocityCommand wanted{};
  if (step.estimate) {
    inputs.localized = true;
    inputs.position_sigma_m = step.estimate->position_sigma_m();
    inputs.cross_track_m = progress_->cross_track_m;
    inputs.clearance_m = clearance_m(robot_.hull, lift(step.estimate->map_T_base), map_);
    wanted = pure_pursuit(route_, step.estimate->map_T_base, *progress_, options_.pursuit);
  }
  const SafetyVerdict verdict = limit(wanted, inputs, options_.safety);
  step.command = last_command_ = verdict.command;
  step.reason = verdict.stopped;
  if (state_ != ReplayState::Waiting) {
    const ReplayState next = verdict.stopped ? ReplayState::Stopped : ReplayState::Driving;
    if (next == ReplayState::Stopped && state_ == ReplayState::Driving) ++stops_;
    state_ = next;
  }
  step.state = state_;
  return step;
}

}  // namespace waymark
