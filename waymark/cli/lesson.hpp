#pragma once

#include <string>

#include "waymark/cli/console.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/drivers/simulated/scene_eye.hpp"
#include "waymark/pipeline/teach_monitor.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark::cli {

/// The samples of a lap on their way into the file and past the teacher.
class Lesson {
 public:
  /// `images`: how pictures are recorded (raw, jpeg; empty: not at all).
  Lesson(TeachSetup setup, const TeachMonitorOptions& monitor, std::string images, SampleRecorder& recorder,
         Console& console)
      : teacher_(std::move(setup)),
        monitor_(monitor),
        images_(std::move(images)),
        recorder_(recorder),
        console_(console) {}

  Status on_sample(const Sample& sample);
  /// A rendered picture and what is true of it; its tags come as a sample as well.
  Status on_picture(const SeenPicture& seen);
  [[nodiscard]] TeachSummary summary() const;
  [[nodiscard]] const TeachMonitor& monitor() const { return monitor_; }

 private:
  [[nodiscard]] std::string live_words(const TagFrame& frame) const;

  Teacher teacher_;
  TeachMonitor monitor_;
  std::string images_;
  SampleRecorder& recorder_;
  Console& console_;
};

/// For the camera of the stage.
[[nodiscard]] TeachMonitorOptions monitor_options(const SimulatedStage& stage);

[[nodiscard]] TeachReport report_of(const Lesson& lesson, const LapEnd& end, const Stopwatch& watch);

}  // namespace waymark::cli
