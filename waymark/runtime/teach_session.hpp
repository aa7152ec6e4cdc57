#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "waymark/pipeline/teacher.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/session_request.hpp"

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

struct TeachSessionOptions {
  /// After so long without odometry or pictures the listener is told. Infinite: never.
  double silence_s = std::numeric_limits<double>::infinity();
};

/// A lap that is driven once, as it goes on: the driver decides, everything is listened to, and zero is sent
/// when the lap is over.
class TeachSession {
 public:
  /// The driver outlives the session.
  TeachSession(LapDriver& driver, LapMonitor lap, SessionRequests requests = no_requests(),
               const TeachSessionOptions& options = {})
      : driver_(driver), lap_(std::move(lap)), requests_(std::move(requests)), options_(options) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// This session as what drives a robot: add to it who may stop it.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] const LapMonitor& lap() const { return lap_; }
  /// Whether the lap is over: the driver was done, or somebody ended it.
  [[nodiscard]] bool finished() const { return finished_; }
  /// How it ended, where the loop did.
  [[nodiscard]] LapEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    bool received = false;  ///< since the last decision
    bool silence_reported = false;
    Duration last{};
    bool ever_received = false;
  };
  void notice_silence(Stream& stream, Duration uptime, const char* what);

  LapDriver& driver_;
  LapMonitor lap_;
  SessionRequests requests_;
  TeachSessionOptions options_;
  Stream odometry_{};
  Stream camera_{};
  bool finished_ = false;
};

}  // namespace waymark
