#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/pipeline/localizer.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/session_request.hpp"

namespace waymark {

/// Callbacks of a LocalizeSession; an error ends the session.
struct LocalizeListener {
  /// Every sample, after the localizer received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every observation of a map tag with its prediction.
  std::function<Status(const NisRecord&)> on_comparison = [](const NisRecord&) { return Status(); };
  /// Every estimate with a newer stamp than the last one, certain or not.
  std::function<Status(const LocalizationEstimate&)> on_estimate = [](const LocalizationEstimate&) {
    return Status();
  };
  /// The newest estimate, once per LocalizeSessionOptions::report_every of the robot's time. None if there is
  /// no estimate, or none newer for LocalizeSessionOptions::silence_s.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
};

struct LocalizeSessionOptions {
  Duration report_every = std::chrono::seconds(1);
  double most_s = std::numeric_limits<double>::infinity();  ///< duration of the session
  /// Time without odometry, or without tags and images, after which on_message is called, once per silence.
  double silence_s = 2;
};

/// Result of a localisation session.
struct LocalizeEnd {
  bool finished = false;     ///< it ran for its full time, or was ended by a button
  bool interrupted = false;  ///< it was ended by a signal
  double seconds = 0;        ///< duration by the robot's clock
};

/// Localises a robot that another program drives. Use it with RobotLoopOptions::listen_only, because this
/// session always decides zero.
class LocalizeSession {
 public:
  LocalizeSession(Localizer localizer, LocalizeListener listener, SessionRequests requests = no_requests(),
                  const LocalizeSessionOptions& options = {})
      : localizer_(std::move(localizer)),
        listener_(std::move(listener)),
        requests_(std::move(requests)),
        options_(options) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Callbacks that connect this session to a robot; set should_stop to end it from outside.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] Localizer& localizer() { return localizer_; }
  /// The result, combined with that of the loop.
  [[nodiscard]] LocalizeEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    const char* name;
    bool received = false;  ///< since the last decision
    bool silence_reported = false;
    Duration last{};
    bool ever_received = false;
  };
  void restart_from(const GivenPose& given);
  void notice_silence(Stream& stream, Duration uptime) const;
  void notice_foreign_tags(Duration uptime);

  Localizer localizer_;
  LocalizeListener listener_;
  SessionRequests requests_;
  LocalizeSessionOptions options_;
  std::vector<Stream> streams_ = {{.name = "odometry"}, {.name = "tags or images"}};
  std::optional<SensorTime> estimated_{};  ///< stamp of the newest estimate
  bool estimating_ = false;                ///< there is a newer estimate since the last decision
  Duration estimated_at_{};                ///< uptime of the decision after the newest estimate
  std::set<TagId> tags_{};                 ///< tags observed before the first estimate
  std::optional<Duration> tags_since_{};
  bool foreign_tags_reported_ = false;
  std::optional<SensorTime> next_report_{};
  bool finished_ = false;
};

}  // namespace waymark
