#include "waymark/app/replay/replay_log.hpp"

#include <fmt/format.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {

Status ReplayLog::on_sample(const Sample& sample) {
  if (const auto* truth = std::get_if<TruthPose>(&sample))
    true_path_.push_back({truth->stamp, truth->map_T_base});
  if (!recorder_) return {};
  if (const auto* picture = std::get_if<CameraFrame>(&sample))
    return record_picture(*picture, images_, *recorder_);
  return recorder_->add(sample);
}

Status ReplayLog::on_step(SensorTime now, const ReplayStep& step) {
  if (Status status = notes_.add(now, step, recorder_ ? &*recorder_ : nullptr); !status) return status;
  control_.progress(
      {.words = fmt::format("{:.1f} of {:.1f} m{}{}. Space or Ctrl-C stops the robot.", step.driven_m,
                            goal_m_, step.reason ? ", stands: " : "", step.reason.value_or(""))});
  if (!recorder_ || !step.estimate) return {};
  return recorder_->add_message(topics::kEstimate, now, estimate_message(*step.estimate));
}

ReplayListener ReplayLog::listener() {
  return {.on_sample = [this](const Sample& sample) { return on_sample(sample); },
          .on_step = [this](SensorTime now, const ReplayStep& step) { return on_step(now, step); }};
}

Status ReplayLog::close() { return recorder_ ? recorder_->close() : Status(); }

}  // namespace waymark
