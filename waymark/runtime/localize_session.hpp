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
  /// Called with every sample, after the localizer has received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called with every observation of a map tag and its prediction.
  std::function<Status(const NisRecord&)> on_comparison = [](const NisRecord&) { return Status(); };
  /// Called with every estimate that is newer than the previous one, whether or not it is certain.
  std::function<Status(const LocalizationEstimate&)> on_estimate = [](const LocalizationEstimate&) {
    return Status();
  };
  /// Called with the newest estimate each time LocalizeSessionOptions::report_every has passed on the robot's
  /// clock. It is `nullopt` if there is no estimate, or no new one for LocalizeSessionOptions::silence_s.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
};

struct LocalizeSessionOptions {
  Duration report_every = std::chrono::seconds(1);
  double most_s = std::numeric_limits<double>::infinity();  ///< maximum duration of the session
  /// Time without odometry, or without tags and images, after which on_message is called, once each time.
  double silence_s = 2;
};

/// Result of a localisation session.
struct LocalizeEnd {
  bool finished = false;     ///< whether it ran for its full time or was ended by a button
  bool interrupted = false;  ///< whether it was ended by a signal
  double seconds = 0;        ///< duration on the robot's clock
};

/// Localises a robot that is driven by another program. Use it with RobotLoopOptions::listen_only, because
/// this session always commands zero.
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
  /// Callbacks that connect this session to a robot; set should_stop to end the session from outside.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] Localizer& localizer() { return localizer_; }
  /// The result, combined with the result of the loop.
  [[nodiscard]] LocalizeEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    const char* name;
    bool received = false;  ///< whether a sample arrived since the last decision
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
  std::optional<SensorTime> estimated_{};  ///< timestamp of the newest estimate
  bool estimating_ = false;                ///< whether there has been a newer estimate since the last
                                           ///< decision
  Duration estimated_at_{};                ///< uptime at the first decision after the newest estimate
  std::set<TagId> tags_{};                 ///< tags observed before the first estimate
  std::optional<Duration> tags_since_{};
  bool foreign_tags_reported_ = false;
  std::optional<SensorTime> next_report_{};
  bool finished_ = false;
};

}  // namespace waymark
