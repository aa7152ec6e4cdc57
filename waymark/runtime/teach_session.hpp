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

/// Callbacks for teaching a lap.
struct TeachListener {
  /// Called with every sample, in order, so that it can be recorded. An error ends the lap.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called with the progress and current warnings, after each image that was searched for tags.
  std::function<void(const std::string&)> on_progress = [](const std::string&) {};
  /// Called with a message for the driver.
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
};

/// Passes the samples of a lap to the teacher and the monitor, and to the listener that records them.
class LapMonitor {
 public:
  LapMonitor(TeachSetup setup, const TeachMonitorOptions& monitor, TeachListener listener)
      : teacher_(std::move(setup)), monitor_(monitor), listener_(std::move(listener)) {}

  Status receive(const Sample& sample);
  /// The teacher's summary, including the warnings from the monitor.
  [[nodiscard]] TeachSummary summary() const;
  [[nodiscard]] const TeachMonitor& monitor() const { return monitor_; }
  [[nodiscard]] const TeachListener& listener() const { return listener_; }

 private:
  /// A progress line with the time since the first frame of the lap.
  [[nodiscard]] std::string progress(SensorTime stamp, std::size_t tags);

  Teacher teacher_;
  TeachMonitor monitor_;
  TeachListener listener_;
  std::optional<SensorTime> began_{};
};

/// The monitor options for a camera: exposure time, and pixels per radian at the image centre.
[[nodiscard]] TeachMonitorOptions monitor_options(const CameraModel& camera,
                                                  std::optional<double> exposure_ms = {});

struct TeachSessionOptions {
  /// Time without odometry or camera frames after which on_message is called; never if infinite.
  double silence_s = std::numeric_limits<double>::infinity();
};

/// Runs one lap. The driver decides, all samples are passed to the monitor, and zero is sent when the lap is
/// over.
class TeachSession {
 public:
  /// The driver must outlive the session.
  TeachSession(LapDriver& driver, LapMonitor lap, SessionRequests requests = no_requests(),
               const TeachSessionOptions& options = {})
      : driver_(driver), lap_(std::move(lap)), requests_(std::move(requests)), options_(options) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Callbacks that let this session drive a robot; set should_stop to end the session from outside.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] const LapMonitor& lap() const { return lap_; }
  /// Whether the lap is over, because the driver was done or a request ended it.
  [[nodiscard]] bool finished() const { return finished_; }
  /// The result, combined with the result of the loop.
  [[nodiscard]] LapEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    bool received = false;  ///< whether a sample arrived since the last decision
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
