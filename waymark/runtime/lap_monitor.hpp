#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/pipeline/teacher.hpp"

namespace waymark {

/// What becomes of a lap as it is taught.
struct TeachListener {
  /// Every sample, in order: for a recording. An error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// After each picture that was searched for tags: how far the lap is, and what is wrong at the moment.
  std::function<void(const std::string&)> on_progress = [](const std::string&) {};
  /// A sentence for whoever drives.
  std::function<void(const std::string&)> on_words = [](const std::string&) {};
};

/// The samples of a lap on their way past the teacher and the monitor to whoever records them.
class LapMonitor {
 public:
  LapMonitor(TeachSetup setup, const TeachMonitorOptions& monitor, TeachListener listener)
      : teacher_(std::move(setup)), monitor_(monitor), listener_(std::move(listener)) {}

  Status receive(const Sample& sample);
  /// Of the teacher, with the warnings of the monitor.
  [[nodiscard]] TeachSummary summary() const;
  [[nodiscard]] const TeachMonitor& monitor() const { return monitor_; }
  [[nodiscard]] const TeachListener& listener() const { return listener_; }

 private:
  /// Of the seconds since the first picture of the lap.
  [[nodiscard]] std::string progress(SensorTime stamp, std::size_t tags);

  Teacher teacher_;
  TeachMonitor monitor_;
  TeachListener listener_;
  std::optional<SensorTime> began_{};
};

/// The monitor for a camera: exposure, and pixels a radian in the middle of its picture.
[[nodiscard]] TeachMonitorOptions monitor_options(const CameraModel& camera,
                                                  std::optional<double> exposure_ms = {});

}  // namespace waymark
