#pragma once

#include <optional>
#include <string>
#include <utility>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/replay/replay_notes.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// What is kept and shown of a replay as it is driven: the recording, the true path, the stations, a live
/// line.
class ReplayLog {
 public:
  /// `images`: how pictures are recorded (raw, jpeg; empty: not at all).
  ReplayLog(std::optional<SampleRecorder> recorder, std::string images, double goal_m,
            const JobControl& control)
      : recorder_(std::move(recorder)),
        images_(std::move(images)),
        goal_m_(goal_m),
        control_(control),
        notes_(control) {}

  Status on_sample(const Sample& sample);
  Status on_step(SensorTime now, const ReplayStep& step);
  /// This log as the listener of a session.
  [[nodiscard]] ReplayListener listener();
  /// Closes the recording.
  Status close();

  [[nodiscard]] Trajectory& true_path() { return true_path_; }
  [[nodiscard]] const std::vector<StationVisit>& visits() const { return notes_.visits(); }

 private:
  std::optional<SampleRecorder> recorder_;
  std::string images_;
  double goal_m_;
  const JobControl& control_;
  ReplayNotes notes_;
  Trajectory true_path_{};
};

}  // namespace waymark
