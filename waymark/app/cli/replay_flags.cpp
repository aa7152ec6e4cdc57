#include "waymark/app/cli/replay_flags.hpp"

namespace waymark::cli {
namespace {

/// Keys of the follower that are used by every controller.
bool every_controller_uses(std::string_view key) { return key == "stop_within_m" || key == "brake_m_s2"; }

}  // namespace

ReplayFlags::ReplayFlags(Settings& settings, Reach reach)
    : app_(settings.app()),
      filter_(settings, "filter", "Methods riekf and ekf", reach),
      follower_(settings, "follower", "Controller follower", reach),
      actuators_(settings, "actuators", "Motion of the robot", reach),
      profile_(settings, "profile", "Speed", reach),
      watch_(settings, "watch", "Alarms", reach),
      consistency_(settings, "consistency", "Alarms: inconsistent sources of motion", reach),
      safety_(settings, "safety", "Limits", reach) {
  if (reach == Reach::SettingsOnly) return;
  anchor_.emplace(settings, "anchor", "Method anchor");
  pursuit_.emplace(settings, "pursuit", "Controller pursuit");
  goal_.emplace(settings, "goal", "Controller pose");
  settings.app().get_option("--speed-m-s")->group(kFirstGroup);
}

Status ReplayFlags::check(const ReplayJob& job) const {
  const ReplayController controller = job.replay.controller;
  const bool by_anchor = job.method == LocalizationKind::Anchor;
  const char* choose = "Omit this option, or choose its method or controller (--method, --controller).";
  Refusals refused(app_);
  if (anchor_) refused.options(!by_anchor, *anchor_, "this is an option of the method anchor", choose);
  refused.options(by_anchor, filter_, "this is an option of the methods riekf and ekf", "Omit this option.");
  refused.options(true, filter_, kNoDelay, "Omit this option.", "lag_s");
  if (pursuit_)
    refused.options(controller != ReplayController::Pursuit, *pursuit_,
                    "this is an option of the controller pursuit", choose);
  if (goal_)
    refused.options(controller != ReplayController::Pose, *goal_, "this is an option of the controller pose",
                    choose);
  for (const std::string& key : field_names<FollowerOptions>())
    refused.options(controller != ReplayController::Follower && !every_controller_uses(key), follower_,
                    "this is an option of the controller follower", "Omit this option.", key);
  return refused.status();
}

Status ReplayFlags::apply(ReplayJob& job) const {
  Status status = check(job);
  if (status && anchor_) status = anchor_->apply(job.anchor);
  if (status) status = filter_.apply(job.filter);
  if (status) status = follower_.apply(job.replay.follower);
  if (status) status = actuators_.apply(job.replay.actuators);
  if (status) status = profile_.apply(job.replay.profile);
  if (status && pursuit_) status = pursuit_->apply(job.replay.pursuit);
  if (status && goal_) status = goal_->apply(job.replay.goal);
  if (status) status = watch_.apply(job.replay.watch);
  if (status) status = consistency_.apply(job.replay.consistency);
  if (status) status = safety_.apply(job.replay.safety);
  return status;
}

}  // namespace waymark::cli
